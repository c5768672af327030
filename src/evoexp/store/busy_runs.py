"""Tells whether a run is being written."""

from filelock import FileLock, Timeout

from evoexp.store.run_directory import RunDirectory


def is_being_written(run: RunDirectory) -> bool:
    """Return whether another process holds the lock of a run; the lock is free again at once."""
    path = run.path / ".lock"
    if not path.exists():
        return False
    try:
        with FileLock(path, timeout=0):
            return False
    except Timeout:
        return True
    except OSError:  # outputs that may only be read
        return False
