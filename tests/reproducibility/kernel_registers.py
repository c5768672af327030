"""A process of its own: compiles kernels afresh and prints the vector registers they use.

EVOEXP_CACHE must be a new directory: numba has no assembly of functions that come from its cache.
"""

import json
import re

import numpy as np

from evoexp.paths import lengths, relaxation


def main() -> None:
    via_points, arms = np.zeros((4, 21, 8)), np.array([[0, 2], [2, 4]])
    lengths.measure_paths(via_points, arms, np.empty((2, 8)), np.empty((2, 8)))
    relaxation.relax_points(via_points, 0.5, 8)
    values = [value for module in (lengths, relaxation) for value in vars(module).values()]
    kernels = [value for value in values if getattr(value, "nopython_signatures", None)]
    assembly = "\n".join(text for kernel in kernels for text in kernel.inspect_asm().values())
    print(
        json.dumps(
            {name: len(re.findall(rf"%{name}\d", assembly)) for name in ("xmm", "ymm", "zmm")}
        )
    )


if __name__ == "__main__":
    main()
