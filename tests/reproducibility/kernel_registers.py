"""A process of its own: compiles a real kernel afresh and prints which vector registers its assembly names.

EVOEXP_CACHE must be a new directory: numba has no assembly of functions that come from its cache.
"""

import json
import re

import numpy as np

from evoexp.paths import redistribution
from evoexp.paths.workspace import prepare_redistribution


def main() -> None:
    num_via_points, lanes = 20, 8
    arms = np.array([[0, 2], [2, 4]])
    population = np.linspace(0.0, 1.0, 4 * (num_via_points + 1) * lanes).reshape(4, num_via_points + 1, lanes) ** 2
    workspace = prepare_redistribution(num_via_points, 2, "natural", 8)
    redistribution.redistribute(population, arms, lanes, workspace)
    compiled = [value for value in vars(redistribution).values() if getattr(value, "nopython_signatures", None)]
    assembly = "\n".join(text for function in compiled for text in function.inspect_asm().values())
    found = {name: len(re.findall(rf"%{name}\d", assembly)) for name in ("xmm", "ymm", "zmm")}
    print(json.dumps(found | {"kernels": len(compiled)}))


if __name__ == "__main__":
    main()
