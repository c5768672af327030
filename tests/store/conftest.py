"""A run directory to fill."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from store_samples import CONDITION, CONFIG, generations, write

from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory


@pytest.fixture
def run(tmp_path: Path) -> RunDirectory:
    """Return a created run directory."""
    directory = RunDirectory(tmp_path, CONDITION)
    directory.create(CONFIG, {"condition": CONDITION})
    return directory


@pytest.fixture
def add(run: RunDirectory) -> Callable[..., Finished]:
    """Return a function that stores a small finished log in `run`."""

    def store(replicate: int, **changes: Any) -> Finished:
        finished = write(generations(6, seed=replicate), replicate, **changes)
        run.write_logs({replicate: finished.content})
        return finished

    return store
