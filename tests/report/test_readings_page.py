"""The page of a paper's readings, on a small experiment of its own."""

import pandas as pd
import pytest

from evoexp.report.figures.side_by_side import draw_specification
from evoexp.report.pages.judged_claims import Headline, over_readings
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Claim, Page
from evoexp.report.results.stored_results import ConditionResults, Results, gather
from evoexp.report.statistics.comparisons import by_column
from evoexp.report.statistics.judging import Judge, Rule
from report_samples import page_settings, smoke_experiment, store

EXPERIMENT = """
# @package _global_
defaults:
  - override /robot: floor_platform
  - override /scenario: chen
  - override /planner: grid_path_ga
  - override /ga: chen_path
  - override /objective: chen_path_a
  - override /collision: chen
conditions:
  "(a)":
    beside: {"random walks": [control=random_search]}
    readings:
      "one elite": [ga.num_elites=1]
      "a smaller map": ["scenario.obstacles=[[6, 8, 9, 11]]"]
"""
RULES = {
    "short": Rule("short", "{who}a short path", "Fig. 2", "own", "it is short", "", {}, ("e",))
}
CONTROLS: dict[str, list[str]] = {}
DEPENDS_ON_BOTH = (
    "depends on the reading (practically equal under 1 of 2, contradicted under 1 of 2)"
)


def judged(condition: ConditionResults, controls: tuple[ConditionResults, ...]) -> Claim:
    """Judge by the number of obstacles, so that one variation differs."""
    CONTROLS[condition.label] = [c.label for c in controls]
    hearing = Judge("", SETTINGS, RULES).on("short", who="")
    return hearing.own("told", 2, len(condition.condition.scenario.obstacles) > 1)  # type: ignore[attr-defined]


SETTINGS = page_settings("chen_path", "generic")
HEADLINE = Headline("short", "length [node]", by_column("term_distance"), judged)


def page_of(results: Results) -> Page:
    """Return the page of one headline claim."""
    own = {"paper": "Chen", "read_results": results, "headlines": [HEADLINE]}
    return own_page("readings", results, SETTINGS, **own)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("readings")
    (folder / "open.yaml").write_text(EXPERIMENT)
    experiment, outputs = smoke_experiment(str(folder / "open.yaml")), folder / "outputs"
    store(outputs, experiment)
    planned, options = experiment.num_replicates, experiment.options
    return gather(outputs, experiment.conditions, planned, "open", "smoke", "", options)


def test_every_assumed_number_stands_with_its_reason_and_its_variations(results: Results) -> None:
    page = page_of(results)
    effects, numbers = page.tables
    rows = {str(row[0]): row for row in numbers.rows}
    assert rows["`ga.num_elites`"][1:] == ("0", "–", "not printed", "(a), one elite")
    assert rows["`scenario.obstacles[…]`"][1] == "13 values"
    assert rows["`scenario.obstacles[…]`"][4] == "(a), a smaller map"
    assert rows["`ga.mutation_rate`"][4] == "not varied"
    assert "`ga.population_size`" not in rows  # it is printed
    assert [row[:2] for row in effects.rows] == [
        ("(a)", "as we read it"),
        ("(a), one elite", "`ga.num_elites`"),
        ("(a), a smaller map", "`scenario.obstacles`"),
    ]
    assert "**contradicted**" in str(effects.rows[2][3])
    assert "**" not in str(effects.rows[1][3])
    assert CONTROLS["(a)"] == ["(a), random walks"]
    assert CONTROLS["(a), one elite"] == ["(a), one elite, random walks"]


def test_a_claim_has_one_verdict_over_all_readings(results: Results) -> None:
    (claim,) = page_of(results).claims
    assert claim.text == "(a): a short path"
    assert claim.verdict == (
        "depends on the reading (reproduced under 2 of 3, contradicted under 1 of 3)"
    )
    assert claim.evidence == "told; contradicted if a smaller map"


@pytest.mark.parametrize(
    ("first", "others", "verdict"),
    [
        ("reproduced", [], "reproduced"),
        ("reproduced", ["reproduced"], "reproduced (under all 2 readings)"),
        ("undecided", ["reproduced"] * 2, "reproduced (under 2 of 3)"),
        ("undecided", ["reproduced"], "undecided (reproduced under 1 of 2)"),
        ("undecided", ["undecided"], "undecided (under all 2 readings)"),
        ("practically equal", ["contradicted"], DEPENDS_ON_BOTH),
        ("not judged (budget smoke)", ["not judged (budget smoke)"], "not judged (budget smoke)"),
    ],
)
def test_verdicts_over_readings(first: str, others: list[str], verdict: str) -> None:
    assert over_readings(first, others) == verdict


def test_the_figure_sorts_the_readings(results: Results) -> None:
    page = page_of(results)
    table = page.drawings[0].table()
    assert list(table["reading"]) == ["as we read it", "one elite", "a smaller map"]
    assert list(table["verdict"]) == ["reproduced", "reproduced", "contradicted"]
    figure = page.drawings[0].draw(table)
    shown = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert shown == list(table.sort_values(["value", "reading"])["reading"])


def test_families_stand_one_below_the_other(results: Results) -> None:
    table = page_of(results).drawings[0].table()
    both = pd.concat([table, table.assign(family="(b)")])
    (axes,) = draw_specification(both).axes
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert len(labels) == 2 * (len(table) + 1) and [labels[0], labels[4]] == ["(a):", "(b):"]
    assert sorted(labels[1:4]) == sorted(labels[5:]) == sorted(table["reading"])
