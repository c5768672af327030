"""The user's cache: a directory that is theirs alone, and files in it that are checked when read.

Compiled kernels are unpickled and run. So nothing is read out of a directory or a file of another
user, and every file begins with a hash of its name and content, which is compared before anything
is done with them. A damaged file counts as missing: it is made again, and one line says so.
"""

import atexit
import contextlib
import functools
import os
import shutil
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import platformdirs
import xxhash

VARIABLE = "EVOEXP_CACHE"  # names the directory; by default it is the system's for this user
_SIZE = 16  # [B] of the hash
_OTHERS_MAY_WRITE = 0o022  # bits of a directory's mode
_owner: Callable[[], int] | None = getattr(os, "geteuid", None)  # of files; some systems lack it


class Damaged(Exception):
    """A file that is not as it was written, or that another user wrote."""


class _Messages:
    """The one line that is printed on standard error, and whether this process prints it.

    Attributes:
        are_printed: Workers print nothing, as their parent prints the same.
        damage_stays: Damaged files are left as they are, for another process to find.
    """

    def __init__(self) -> None:
        self.are_printed, self.damage_stays = True, False
        self._said = set[str]()

    def say(self, what: str, text: str) -> None:
        """Print a line; the second and later ones about the same are left out."""
        if self.are_printed and what not in self._said:
            self._said.add(what)
            with contextlib.suppress(OSError, ValueError):
                print(f"evoexp: {text}", file=sys.stderr, flush=True)


MESSAGES = _Messages()


@contextlib.contextmanager
def damage_left_alone() -> Iterator[None]:
    """Leave damaged files as they are meanwhile; this process prints nothing from now on."""
    MESSAGES.are_printed, MESSAGES.damage_stays = False, True
    try:
        yield
    finally:
        MESSAGES.damage_stays = False


def cache_root() -> Path:
    """Return a directory that this user can write and nobody else; a temporary one if need be."""
    named = os.environ.get(VARIABLE) or platformdirs.user_cache_dir("evoexp")
    return _settled(named)


@functools.cache
def _settled(named: str) -> Path:
    directory = Path(named)
    reason = "must be an absolute path"  # a user without a home, unless it is EVOEXP_CACHE
    if directory.is_absolute() or VARIABLE in os.environ:
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            reason = _made_private(directory)
        except OSError as error:
            reason = error.strerror or str(error)
        if not reason:
            return directory
    temporary = Path(tempfile.mkdtemp(prefix="evoexp-"))
    os.environ[VARIABLE] = str(temporary)  # worker processes inherit it
    atexit.register(_remove, temporary, os.getpid())
    text = f"{directory}: {reason}; kernels are compiled for this command and not kept"
    MESSAGES.say("cache", text)
    return temporary


def _made_private(directory: Path) -> str:
    """Take others' permission to write; return why a directory cannot be used, or nothing."""
    status = directory.stat()
    if _owner is not None and status.st_uid != _owner():
        return "belongs to another user, whose files are not run"
    if not os.access(directory, os.W_OK | os.X_OK):
        return "cannot be written"
    if _owner is not None and status.st_mode & _OTHERS_MAY_WRITE:
        directory.chmod(status.st_mode & ~_OTHERS_MAY_WRITE & 0o777)
    return ""


def _remove(temporary: Path, process: int) -> None:
    if os.getpid() == process:  # and not a worker that was forked from it
        shutil.rmtree(temporary, ignore_errors=True)


def read_kept(path: Path) -> bytes:
    """Return the content of a kept file.

    Raises:
        FileNotFoundError: If it is not there.
        Damaged: If it is not as it was written, or not this user's.
    """
    try:
        with open(path, "rb") as file:
            if _owner is not None and os.fstat(file.fileno()).st_uid != _owner():
                raise Damaged(path)
            content = file.read()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileNotFoundError(path) from error
    except OSError as error:
        raise Damaged(path) from error
    if content[:_SIZE] != _hash(path, content[_SIZE:]):
        raise Damaged(path)
    return content[_SIZE:]


def write_kept(path: Path, content: bytes) -> None:
    """Keep a file under a name, whole or not at all.

    Raises:
        OSError: If that cannot be done.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}.tmp")
    try:
        temporary.write_bytes(_hash(path, content) + content)
        if path.is_dir():  # put there by somebody else: no file can take its place
            shutil.rmtree(path)
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def is_kept(path: Path) -> bool:
    """Return whether a file is there and as it was written; if it is damaged, that is said."""
    try:
        read_kept(path)
    except FileNotFoundError:
        return False
    except Damaged:
        say_damaged(path)
        return False
    return True


def say_damaged(path: Path) -> None:
    """Say, for the first one only, that a file is damaged."""
    MESSAGES.say("damaged", f"{path}: damaged; damaged kernels are compiled again")


def _hash(path: Path, content: bytes) -> bytes:
    """Return the hash of a content under a name and that of its folder, wherever the cache is."""
    digest = xxhash.xxh3_128(f"{path.parent.name}/{path.name}\0".encode(errors="surrogateescape"))
    digest.update(content)
    return digest.digest()
