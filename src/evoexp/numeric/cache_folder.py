"""The user's cache: a folder that is theirs alone, and files in it that are checked when read.

Compiled kernels are unpickled and run. So nothing is read out of a folder or a file of another
user. A file begins with a hash of its name and content, and counts as missing if it is damaged.
"""

import atexit
import contextlib
import functools
import os
import shutil
import sys
import tempfile
import uuid
from collections.abc import Callable
from pathlib import Path

import platformdirs
import xxhash

VARIABLE = "EVOEXP_CACHE"  # names the folder; by default it is the system's for this user
_SIZE = 16  # [B] of the hash
_OTHERS_MAY_WRITE = 0o022  # bits of a folder's mode


def cache_root() -> Path:
    """Return a folder that this user can write and nobody else; a temporary one if need be."""
    return _settled(os.environ.get(VARIABLE) or platformdirs.user_cache_dir("evoexp"))


@functools.cache
def _settled(named: str) -> Path:
    folder, reason = Path(named), "must be an absolute path"  # a user without a home
    if folder.is_absolute() or VARIABLE in os.environ:
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not is_own(folder):
                reason = "belongs to another user, whose files are not run"
            elif not os.access(folder, os.W_OK | os.X_OK):
                reason = "cannot be written"
            else:
                mode = folder.stat().st_mode
                if mode & _OTHERS_MAY_WRITE:
                    folder.chmod(mode & ~_OTHERS_MAY_WRITE & 0o777)
                return folder
        except OSError as error:
            reason = error.strerror or str(error)
    temporary = Path(tempfile.mkdtemp(prefix="evoexp-"))
    os.environ[VARIABLE] = str(temporary)  # worker processes inherit it
    remove_at_exit(temporary)
    text = f"evoexp: {folder}: {reason}; kernels are compiled for this command and not kept"
    print(text, file=sys.stderr, flush=True)
    return temporary


def remove_at_exit(folder: Path) -> None:
    """Remove a folder when this process ends, and not when one that was forked from it does."""
    process = os.getpid()

    def remove() -> None:
        if os.getpid() == process:
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)


def is_own(path: Path) -> bool:
    """Return whether a file or folder is this user's; where nobody owns files, all are."""
    return not hasattr(os, "geteuid") or path.stat().st_uid == os.geteuid()


def kept(path: Path, make: Callable[[], bytes]) -> bytes:
    """Return the content of a kept file, made and kept first if it is not there."""
    content = read_kept(path)
    if content is None:
        content = make()
        with contextlib.suppress(OSError):  # it takes longer the next time
            write_kept(path, content)
    return content


def read_kept(path: Path) -> bytes | None:
    """Return the content of a kept file; None: it is missing, altered, or not this user's."""
    content = b""
    with contextlib.suppress(OSError):
        content = path.read_bytes() if is_own(path) else b""
    is_whole = content[:_SIZE] == _hash(path, content[_SIZE:])
    return content[_SIZE:] if is_whole else None


def write_kept(path: Path, content: bytes) -> None:
    """Keep a file under a name, whole or not at all; OSError if that cannot be done."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}.tmp")
    try:
        temporary.write_bytes(_hash(path, content) + content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _hash(path: Path, content: bytes) -> bytes:
    """Return the hash of a content under a name and that of its folder, wherever the cache is."""
    digest = xxhash.xxh3_128(f"{path.parent.name}/{path.name}\0".encode(errors="surrogateescape"))
    digest.update(content)
    return digest.digest()
