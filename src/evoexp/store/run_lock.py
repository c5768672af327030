"""The lock of a run, which dies with its process."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from filelock import BaseFileLock


class RunLock:
    """A lock of the operating system on a file; its library is loaded when it is first taken."""

    def __init__(self, path: Path) -> None:
        """Name the file; nothing is made or locked."""
        self._path = path
        self._lock: BaseFileLock | None = None

    def acquire(self) -> bool:
        """Take the lock, or take it once more; return whether nobody else holds it."""
        from filelock import FileLock, Timeout  # who only reads needs none

        self._lock = self._lock or FileLock(self._path, timeout=0)
        try:
            self._lock.acquire()
        except Timeout:
            return False
        return True

    def release(self) -> None:
        """Give the lock back as often as it was taken."""
        if self._lock is not None:
            self._lock.release()
