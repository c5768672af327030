"""Small stored runs of the shipped experiments, run once per test session."""

from pathlib import Path

import pytest

from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results, gather
from report_samples import REPORT, expand, store


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return outputs that hold two experiments; not to be changed."""
    outputs = tmp_path_factory.mktemp("outputs")
    store(outputs, expand("rana_planar"))
    store(outputs, expand("rana_three_arms", "scenario=rana_three_arms"))
    return outputs


@pytest.fixture(scope="session")
def results(stored: Path) -> Results:
    """Return what is stored of the two planar arms and of random search beside them."""
    experiment = expand("rana_planar")
    return gather(
        stored,
        experiment.conditions,
        experiment.num_replicates,
        experiment.name,
        experiment.budget,
        "",
    )


@pytest.fixture
def settings() -> ReportSettings:
    """Return settings of the paper's own page."""
    return ReportSettings(**REPORT, figures="rana")
