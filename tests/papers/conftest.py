"""Small stored runs of the shipped experiments, and outputs for others."""

from pathlib import Path

import pytest

from report_samples import results as results
from report_samples import stored as stored


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return outputs of the tests of one module."""
    return tmp_path_factory.mktemp("outputs")
