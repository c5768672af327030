"""A planner that can be told to fail, installed as a plug-in, and conditions that use it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from batch_samples import WORDS, digests, run
from joblib.externals.loky import get_reusable_executor

from evoexp import condition
from evoexp.condition import Condition
from evoexp.configuration import compose

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def plug_in(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a directory that, on the path, is an installed plug-in."""
    directory = tmp_path_factory.mktemp("plug_in")
    information = directory / "faulty-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(
        "[evoexp.components]\nfaulty = faulty_planner:Faulty\n"
    )
    return directory


@pytest.fixture(autouse=True)
def installed(plug_in: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install it in this process and in the workers that it starts."""
    monkeypatch.syspath_prepend(str(plug_in))
    monkeypatch.syspath_prepend(str(HERE))
    condition._registry.cache_clear()
    yield
    condition._registry.cache_clear()


@pytest.fixture
def fresh_workers() -> Iterator[None]:
    """Have workers that know this test's environment; they keep that of their start."""
    get_reusable_executor().shutdown(wait=True)
    yield
    get_reusable_executor().shutdown(wait=True)


@pytest.fixture
def faulty() -> Condition:
    """Return a condition of the planner that can be told to fail.

    What it is told is no part of it.
    """
    (experiment,) = compose.expand(WORDS)
    return experiment.conditions[0].condition


@pytest.fixture
def undisturbed(faulty: Condition, tmp_path: Path) -> dict[int, str]:
    """Return the digests that every way of running it must come to."""
    run(tmp_path / "undisturbed", (faulty, 12))
    return digests(tmp_path / "undisturbed", faulty)
