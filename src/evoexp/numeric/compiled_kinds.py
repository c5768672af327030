"""Which kinds of conditions all kernels are kept for; no kernel is loaded to tell.

A process that only gives work to others needs neither numba nor any kernel, when all are there.
"""

import contextlib
import functools
import hashlib
import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path

import llvmlite.binding

from evoexp.numeric.code_keys import module_key
from evoexp.numeric.kept_files import Damaged, cache_root, is_kept, read_kept, write_kept

CERTIFIER = "evoexp.collision.certifier.certificate"  # judges the motions of every planner


def is_compiled(kind: str, modules: Iterable[str]) -> bool:
    """Return whether `note_compiled` was told so, and the kernels of then are there and whole.

    Args:
        kind: What was compiled, as text.
        modules: That it is made of; the certifier's are added.
    """
    root = cache_root()
    try:
        names = json.loads(read_kept(_note(kind, modules)))
    except (FileNotFoundError, Damaged):
        return False
    return all(map(_is_whole, [root / name for name in names]))


@functools.cache
def _is_whole(path: Path) -> bool:
    """Return whether a kernel's file is there and undamaged; looked at once per process."""
    return is_kept(path)


def note_compiled(kind: str, modules: Iterable[str]) -> None:
    """Note that every kernel that something of this kind needs is kept; silent where it cannot.

    All files that this process used are noted: kernels that it had loaded before may be among those
    that are needed.
    """
    root = cache_root()
    names = sorted(str(path.relative_to(root)) for path in _used() if path.is_relative_to(root))
    with contextlib.suppress(OSError):
        write_kept(_note(kind, modules), json.dumps(names).encode())
    _is_whole.cache_clear()


def _used() -> set[Path]:
    """Return the files of all kernels that this process loaded or kept: none without numba."""
    files = sys.modules.get("evoexp.numeric.kernel_files")
    return set() if files is None else set(files.USED)


def _note(kind: str, modules: Iterable[str]) -> Path:
    processor = [os.environ.get(f"NUMBA_CPU_{name}") for name in ("NAME", "FEATURES")]
    keys = [module_key(module) for module in sorted({*modules, CERTIFIER})]
    parts = repr((llvmlite.binding.get_host_cpu_name(), processor, keys, kind))
    return cache_root() / "compiled" / hashlib.sha256(parts.encode()).hexdigest()[:32]
