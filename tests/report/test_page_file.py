"""Pages as data: what a guest's `page.yaml` makes, and the fault that each mistake in it is."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from evoexp.errors import EvoexpError, SettingError, UnknownSetting
from evoexp.report.pages.page_builder import build, page_of
from evoexp.report.pages.page_file import PageFile, read_page_file
from evoexp.report.results.stored_results import Results
from guests import on_path, write_distribution
from report_samples import page_settings

FUNCTIONS = """
import pandas as pd

def scale(settings):
    return 2.0

def doubled(condition, scale):
    return scale * condition.column("best_cost")

def costs_table(results, doubled):
    return pd.DataFrame({"cost": [0.0, 1.0]})

def draw_costs(table):
    from matplotlib.figure import Figure
    return Figure()
"""
PAGE = """
name: A guest
functions: [functions]
pages:
  my_paper:
    introduction: "At {level:g} %."
    quantities: [costs, terms]
    tables: [runs]
    comparisons: [{families: whole, measures: [[doubled cost, doubled]]}]
    checks: [runs]
    figures: [costs, best]
quantities: {costs: [[doubled cost, "–", doubled]]}
tables:
  runs:
    heading: Runs
    headers: [condition, solved]
    each: condition in conditions
    cells: ["{condition.label}", "{success}"]
checks:
  runs:
    - [The scale, "{scale:g}"]
    - title: Best costs
      finding: {each: condition in conditions, text: "{best_cost.min!n}"}
figures:
  costs: {title: Costs, caption: Every cost., functions: [costs_table, draw_costs]}
"""
Read = Callable[[str], PageFile]


@pytest.fixture
def read(tmp_path: Path) -> Iterator[Read]:
    """Return the function that reads a page of a package of its own."""
    package = tmp_path / "my_paper"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "functions.py").write_text(FUNCTIONS)
    write_distribution(tmp_path, "my-paper", pages={"my_paper": "my_paper:page.yaml"})

    def read(text: str) -> PageFile:
        (package / "page.yaml").write_text(text)
        return read_page_file("my_paper")

    with on_path(tmp_path):
        yield read
    assert "my_paper.functions" not in sys.modules


def test_a_guests_page_is_built_from_its_file(read: Read, results: Results) -> None:
    settings = page_settings("", "my_paper")
    page = build(read(PAGE), "my_paper", results, settings)
    assert (page.title, page.introduction) == (f"A guest: {results.experiment}", "At 95 %.")
    first = results.with_data[0]
    expected = np.median(2.0 * first.column("best_cost"))
    assert page.quantities[0].spreads[first.label].median == expected
    assert page.tables[0].rows[0] == (first.label, f"{first.solved} of {first.done}")
    assert page.checks[0] == ("The scale", "2")
    assert page.checks[1][1].count(";") == len(results.with_data) - 1
    assert page.comparisons[0][0] == f"doubled cost: {first.label} against …"
    assert [drawing.stem for drawing in page.drawings] == ["costs", "convergence"]
    assert list(page.drawings[0].table()["cost"]) == [0.0, 1.0]
    assert page_of(results, settings).title == page.title  # by its entry point


@pytest.mark.parametrize(
    ("wrong", "right", "kind", "message"),
    [
        ("headres:", "headers:", UnknownSetting, "tables.runs.headres: unknown setting; did you"),
        ("{succes}", "{success}", SettingError, "tables.runs.cells: must be a value or function"),
        ("[costs, bst]", "[costs, best]", SettingError, "my_paper.figures: must be one of the"),
        ("for condition", "condition in", SettingError, "must be 'item in items', was 'for"),
        ("each: run in conditons", "each: condition in conditions", SettingError, "mean 'cond"),
    ],
)
def test_a_mistake_is_one_line(
    read: Read, wrong: str, right: str, kind: type[EvoexpError], message: str
) -> None:
    with pytest.raises(kind) as fault:
        read(PAGE.replace(right, wrong))
    assert message in str(fault.value) and "\n" not in str(fault.value)


PAPERS = ("chen", "corsepius", "curkovic", "lavoie", "rana")


@pytest.mark.parametrize("package", ["report.pages", *(f"papers.{name}" for name in PAPERS)])
def test_every_figure_has_a_table_and_a_drawing(package: str) -> None:
    file = read_page_file(f"evoexp.{package}")
    for entry in file.entries["figures"].values():
        assert "kind" in entry or len(file.table_and_drawing(entry["functions"])) == 2
