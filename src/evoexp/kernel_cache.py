"""Where compiled kernels are kept."""

import contextlib
import hashlib
import importlib
import os
import shutil
import tempfile
from pathlib import Path

import llvmlite.binding
import numba
import platformdirs

_ROOMS = (
    "collision",
    "evolution",
    "objectives",
    "paths",
    "planners",
    "references",
    "robots",
    "scenarios",
)
KERNEL_FILES = ("numerics.py", "draws.py", *(f"{room}/*.py" for room in _ROOMS))

NUM_KEPT_CACHES = 4  # [-] states of the sources whose compiled kernels are kept

_cache_claims: list[
    int
] = []  # open descriptors: a shared lock on our cache directory for as long as we live


def use_keyed_cache() -> None:
    """Give numba a cache directory of its own per state of the sources and per CPU target.

    numba's cache notices an edit in the file of a kernel but not in the files of the functions it
    calls; keyed on all sources that hold kernels or their constants, a stale kernel cannot be
    loaded.
    """
    package = Path(__file__).parent
    target = repr([os.environ.get(f"NUMBA_CPU_{name}") for name in ("NAME", "FEATURES")])
    digest = hashlib.sha256(target.encode())
    for path in sorted(p for room in KERNEL_FILES for p in package.glob(room)):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    directory = cache_root() / "kernels" / digest.hexdigest()[:16]
    numba.config.CACHE_DIR = str(directory)  # type: ignore[attr-defined]
    _prune_caches(directory)
    _spare_blas()


def _spare_blas() -> None:
    """Have numba believe in BLAS unseen.

    To look for it, it loads scipy.linalg, a fifth of a second in every process.

    A kernel that does use it loads it when it is compiled; none of ours does, as BLAS is not
    reproducible bit by bit.
    """
    from numba.np import linalg

    look, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look


def is_compiled(kind: str) -> bool:
    """Return whether `note_compiled` was told so, in this state of the sources."""
    return _note(kind).exists()


def note_compiled(kind: str) -> None:
    """Note that every kernel is in the cache which something of this kind needs.

    Silent where that cannot be done.
    """
    with contextlib.suppress(OSError):
        _note(kind).parent.mkdir(parents=True, exist_ok=True)
        _note(kind).touch()


def _note(kind: str) -> Path:
    digest = hashlib.sha256(f"{llvmlite.binding.get_host_cpu_name()}\0{kind}".encode()).hexdigest()
    return Path(str(numba.config.CACHE_DIR)) / "compiled" / digest[:32]  # type: ignore[attr-defined]


def cache_root() -> Path:
    """Return a directory that can be written.

    Numba would fall back to one beside the sources, which is not keyed.
    """
    user = Path(os.environ.get("EVOEXP_CACHE") or platformdirs.user_cache_dir("evoexp"))
    with contextlib.suppress(OSError):
        user.mkdir(parents=True, exist_ok=True)
        if os.access(user, os.W_OK):
            return user
    os.environ["EVOEXP_CACHE"] = tempfile.mkdtemp(prefix="evoexp-")  # worker processes inherit it
    return Path(os.environ["EVOEXP_CACHE"])


def _prune_caches(current: Path) -> None:
    """Remove the cache directories of older states of the sources.

    Silent where that cannot be done.

    The newest `NUM_KEPT_CACHES` stay (an import renews the time stamp), and so does any that a
    living process uses: each holds a shared lock on its own directory, and only one without can be
    locked exclusively.
    """
    with contextlib.suppress(ImportError, OSError):
        import fcntl  # not on Windows: nothing is pruned there

        current.mkdir(parents=True, exist_ok=True)
        _cache_claims.append(os.open(current, os.O_RDONLY))
        fcntl.flock(_cache_claims[-1], fcntl.LOCK_SH | fcntl.LOCK_NB)
        os.utime(current)
        states = [
            path for path in current.parent.iterdir() if len(path.name) == 16 and path.is_dir()
        ]
        for path in sorted(states, key=lambda path: path.stat().st_mtime, reverse=True)[
            NUM_KEPT_CACHES:
        ]:
            descriptor = os.open(path, os.O_RDONLY)
            with contextlib.suppress(OSError):  # in use
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path, ignore_errors=True)
            os.close(descriptor)
