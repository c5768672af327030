"""Settings of every test, and which tests run.

Property tests draw the same examples each time, and no time is an assertion.
"""

import os

import pytest
from hypothesis import settings

EXHAUSTIVE = "EVOEXP_EXHAUSTIVE"  # set where larger counts are asked for; see `matrix.counts`

settings.register_profile("evoexp", deadline=None, derandomize=True, database=None)
settings.register_profile(
    "exhaustive", deadline=None, derandomize=True, database=None, max_examples=2000
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the two options that run more than the examples."""
    parser.addoption("--all", action="store_true", help="run the tests marked matrix, too")
    parser.addoption("--exhaustive", action="store_true", help="run all tests, with larger counts")


def pytest_configure(config: pytest.Config) -> None:
    """Choose how many examples property tests draw."""
    if config.getoption("--exhaustive"):
        os.environ[EXHAUSTIVE] = "1"
    settings.load_profile("exhaustive" if EXHAUSTIVE in os.environ else "evoexp")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the matrices unless they are asked for, by an option, a marker or their name."""
    asked = config.getoption("--all") or config.getoption("--exhaustive")
    if asked or config.getoption("-m") or any("::" in word for word in config.args):
        return
    left_out = [item for item in items if item.get_closest_marker("matrix")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("matrix")]
