"""Which tests run; property tests draw the same examples each time, and no time is asserted."""

import functools
import gc
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# as in evoexp's workers: two test processes with two threads each wait for each other on two cores
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from matrix import EXHAUSTIVE, MATRICES, matrices_are_asked_for

SAME = {"deadline": None, "derandomize": True, "database": None}
settings.register_profile("evoexp", **SAME)
settings.register_profile("exhaustive", **SAME, max_examples=2000)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the two options that run more than the examples."""
    parser.addoption("--all", action="store_true", help="run the tests marked matrix, too")
    parser.addoption("--exhaustive", action="store_true", help="run all tests, with larger counts")


def pytest_configure(config: pytest.Config) -> None:
    """Choose how many examples property tests draw, and whether the matrices are collected."""
    if config.getoption("--exhaustive"):
        os.environ[EXHAUSTIVE] = "1"
    settings.load_profile("exhaustive" if EXHAUSTIVE in os.environ else "evoexp")
    asked = config.getoption("--all") or EXHAUSTIVE in os.environ or config.getoption("-m")
    if asked or any("::" in word for word in config.args):
        os.environ[MATRICES] = "1"
    gc.disable()  # while thousands of tests are collected, nothing of which is garbage


def pytest_pycollect_makeitem(collector: pytest.Collector, name: str, obj: Any) -> Any:
    """Leave out tests marked `matrix` or `exhaustive` unless asked for; see `matrix.examples`."""
    marked = {mark.name for mark in getattr(obj, "pytestmark", ()) if name.startswith("test")}
    marked.update(mark.name for mark in collector.iter_markers())
    asked = {"matrix": matrices_are_asked_for(), "exhaustive": EXHAUSTIVE in os.environ}
    return [] if any(name in marked and not is_asked for name, is_asked in asked.items()) else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep some cases of tests marked `examples`, unless the matrices are asked for."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("examples") and not matrices_are_asked_for():
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    left_out = set[pytest.Item]()
    for every in cases.values():
        (count,) = next(every[0].iter_markers("examples")).args
        left_out.update(set(every) - {every[k * len(every) // count] for k in range(count)})
    if left_out:
        config.hook.pytest_deselected(items=list(left_out))
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture(autouse=True, scope="session")
def composed_once() -> Iterator[None]:
    """Have Hydra compose a choice of options once, as long as no option file changes: it is slow.

    Nothing is remembered of what evoexp itself does with it.
    """
    from evoexp.configuration import compose
    from evoexp.configuration.search_path import folders

    compositions = dict[Any, compose.Composed]()
    by_hydra = compose.Composer.by_hydra

    def remembered(composer: Any, words: list[str]) -> compose.Composed:
        roots = [composer.root, *(folder.path for folder in folders())]
        files = [path for root in roots for path in root.glob("*/*.yaml")]
        state = [(path.name, path.stat().st_mtime_ns) for path in sorted(files)]
        key = (*words, composer.file, *(folder.path for folder in folders()), *state)
        if key not in compositions:
            compositions[key] = by_hydra(composer, words)
        return compositions[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compose.Composer, "by_hydra", remembered)
        yield


@pytest.fixture
def outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return where the commands of this test write; not there yet."""
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "outputs"))
    return tmp_path / "outputs"


@pytest.fixture
def blank_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have every figure of a report blank: drawing takes nine tenths of its time."""
    from evoexp.report.figures import style

    draw = style.drawn

    @functools.cache
    def blank(formats: tuple[str, ...]) -> dict[str, bytes]:
        from matplotlib.figure import Figure

        return draw(lambda: Figure((1.0, 1.0)), formats, 20)

    monkeypatch.setattr(style, "drawn", lambda drawing, formats, *_: blank(tuple(formats)))


def pytest_collection_finish() -> None:
    """Let garbage be collected again, and what is kept never be looked at."""
    gc.freeze()
    gc.enable()
