"""Kernels out of the cache: machine code at once, code to be inlined when it is asked for."""

import os
import subprocess
import sys
from pathlib import Path

CODE = """
import numpy as np
from evoexp.numeric.compilation import kernel

@kernel
def root(x):
    return x ** 0.5

@kernel
def twice(x):
    return 2.0 * root(x)

@kernel
def total(x):
    if len(x) == 0:
        raise ValueError("nothing to add")
    return x.sum()

@kernel
def twofold(x):
    return total(x) + x.sum()
"""
USE = """
import sys, guest
from llvmlite import binding
parse, parsed = binding.parse_bitcode, []
binding.parse_bitcode = lambda *given: parsed.append(1) or parse(*given)
value = guest.root(4.0)
before = len(parsed), "numba.np.linalg" in sys.modules
hits = sum(guest.root.stats.cache_hits.values())
print(value, hits, *before, {rest}, bool(parsed))
"""

# A function of numba's own in a kernel, and those that count references: are they loaded as kept?
USE_OF_NUMBA = """
import sys, guest
import numpy as np
from numba.core.runtime import nrtdynmod
make, made = nrtdynmod.create_nrt_module, []
nrtdynmod.create_nrt_module = lambda *given: made.append(1) or make(*given)
value = guest.total(np.array([2.0, 3.0]))
try:
    guest.total(np.empty(0))
except ValueError as error:
    print(value, error, *made, *{"numba.np.arraymath", "scipy.linalg"} & set(sys.modules))
{rest}
"""


def used(folder: Path, rest: str, code: str = USE) -> str:
    environment = os.environ | {"EVOEXP_CACHE": str(folder / "cache"), "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", code.replace("{rest}", rest)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def test_a_kept_kernel_is_read_in_parts(tmp_path: Path) -> None:
    (tmp_path / "guest.py").write_text(CODE)
    first = used(tmp_path, "guest.root(9.0)")
    assert first.startswith("2.0 0 ")
    # neither what is inlined nor what can be compiled is loaded
    assert used(tmp_path, "guest.root(9.0)") == "2.0 1 0 False 3.0 False"
    # another kernel that is compiled now inlines it
    assert used(tmp_path, "guest.twice(9.0)") == "2.0 1 0 False 6.0 True"
    # both are kept
    assert used(tmp_path, "guest.twice(9.0)") == "2.0 1 0 False 6.0 False"


def test_a_kept_kernel_loads_no_module_of_the_functions_that_it_calls(tmp_path: Path) -> None:
    (tmp_path / "guest.py").write_text(CODE)
    first = used(tmp_path, "", USE_OF_NUMBA)
    assert first == "5.0 nothing to add 1 numba.np.arraymath"
    # neither the functions that count references nor those that add are compiled again
    assert used(tmp_path, "", USE_OF_NUMBA) == "5.0 nothing to add"
    # a kernel that is compiled afterwards calls the same functions
    later = "print(guest.twofold(np.ones(3)), *made)"
    assert used(tmp_path, later, USE_OF_NUMBA).split("\n") == ["5.0 nothing to add", "6.0"]


def test_functions_that_count_references_are_made_again_where_the_kept_ones_are_damaged(
    tmp_path: Path,
) -> None:
    (tmp_path / "guest.py").write_text(CODE)
    used(tmp_path, "", USE_OF_NUMBA)
    (kept,) = (tmp_path / "cache").glob("kernels/*/*/reference_counts.*.nbc")
    kept.write_bytes(kept.read_bytes()[:-1] + b"?")
    assert used(tmp_path, "", USE_OF_NUMBA) == "5.0 nothing to add 1"
    assert used(tmp_path, "", USE_OF_NUMBA) == "5.0 nothing to add"
