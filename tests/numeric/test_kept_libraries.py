"""Kernels out of the cache: machine code at once, code to be inlined when it is asked for."""

import os
import subprocess
import sys
from pathlib import Path

CODE = """
from evoexp.numeric.compilation import kernel

@kernel
def root(x):
    return x ** 0.5

@kernel
def twice(x):
    return 2.0 * root(x)
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


def used(folder: Path, rest: str) -> str:
    environment = os.environ | {"EVOEXP_CACHE": str(folder / "cache"), "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", USE.replace("{rest}", rest)],
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
