"""A folder for all temporary files of a command, and the removal of those that killed ones left.

Whatever library makes a temporary file makes it there. The command holds a lock in its folder,
which the system releases when the process ends, however it ends: a folder of this user whose lock
is free has no owner any more. Nothing else is ever removed.
"""

import atexit
import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "evoexp-command-"
LOCK = "owner.lock"


def use_temporary_folder() -> None:
    """Have temporary files of this process, and of those it starts, in a folder of its own.

    Without one, where none can be made, they are where they would be anyhow.
    """
    with contextlib.suppress(OSError):
        place = Path(tempfile.gettempdir())
        remove_abandoned(place)
        folder = place / f"{PREFIX}{os.urandom(8).hex()}"
        folder.mkdir(mode=0o700)
        if not _is_taken(folder):
            return
        atexit.register(_remove, folder, os.getpid())
        os.environ["TMPDIR"] = tempfile.tempdir = str(folder)


def remove_abandoned(place: Path) -> None:
    """Remove the folders of commands that have ended without removing them."""
    for folder in place.glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            if folder.lstat().st_uid == os.geteuid() and not folder.is_symlink():
                _remove_if_abandoned(folder)


def _is_taken(folder: Path) -> bool:
    """Take the lock of a new folder; return False if another command has just removed it."""
    lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o600)  # held until the process ends
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return (folder / LOCK).exists()


def _remove_if_abandoned(folder: Path) -> None:
    lock = os.open(folder / LOCK, os.O_RDWR | os.O_NOFOLLOW)  # one without it may just begin
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # fails while its owner lives
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(lock)


def _remove(folder: Path, process: int) -> None:
    if os.getpid() == process:  # and not a copy of it
        shutil.rmtree(folder, ignore_errors=True)
