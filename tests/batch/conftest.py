"""A planner that can be told to fail, installed as a plug-in, and conditions that use it."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from batch_samples import WORDS, digests, run

from evoexp.condition import Condition
from evoexp.configuration import compose
from guests import on_path, write_distribution

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def plug_in(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a directory that, on the path, is an installed plug-in."""
    directory = tmp_path_factory.mktemp("plug_in")
    write_distribution(directory, "faulty", components={"faulty": "faulty_planner:Faulty"})
    return directory


@pytest.fixture(autouse=True)
def heard_signals() -> Iterator[None]:
    """Have commands start with no signal ignored, wherever tests were started."""
    handlers = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(autouse=True)
def installed(plug_in: Path) -> Iterator[None]:
    """Install it in this process and in the workers that it starts."""
    with on_path(plug_in, HERE):
        yield


@pytest.fixture
def faulty() -> Condition:
    """Return a condition of that planner; how it is to fail is no part of it."""
    return compose.expand(WORDS)[0].conditions[0].condition


@pytest.fixture
def fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Return a function that tells the planner how to fail, in this process and its workers."""
    monkeypatch.setenv("FAULTY_FLAGS", str(tmp_path))
    return lambda faults: monkeypatch.setenv("FAULTY", faults)


@pytest.fixture(scope="session")
def undisturbed(plug_in: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[int, str]:
    """Return the digests that every way of running it must come to."""
    outputs = tmp_path_factory.mktemp("undisturbed")
    with on_path(plug_in, HERE):
        condition = compose.expand(WORDS)[0].conditions[0].condition
        run(outputs, (condition, 12))
        return digests(outputs, condition)
