"""The page of assumed numbers, on a small experiment of its own."""

import pytest

from evoexp.report.pages.assumptions import Headline
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Claim, Page
from evoexp.report.results.stored_results import ConditionResults, Results, gather
from evoexp.report.statistics.claim_rules import Rule
from evoexp.report.statistics.comparisons import by_column
from evoexp.report.statistics.judging import Judge
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
  "as assumed": []
  "as assumed, random walks": [control=random_search]
  "one elite": [ga.num_elites=1]
  "a smaller map": ["scenario.obstacles=[[6, 8, 9, 11]]"]
"""
RULES = {
    "short": Rule("short", "{who}a short path", "Fig. 2", "own", "it is short", "", {}, ("e",))
}
CONTROLS: dict[str, list[str]] = {}


def judged(condition: ConditionResults, controls: tuple[ConditionResults, ...]) -> Claim:
    """Judge by the number of obstacles, so that one variation differs."""
    CONTROLS[condition.label] = [c.label for c in controls]
    hearing = Judge("", SETTINGS, RULES).on("short", who="")
    return hearing.own("told", 2, len(condition.condition.scenario.obstacles) > 1)  # type: ignore[attr-defined]


SETTINGS = page_settings("chen_path", "generic")
HEADLINE = Headline("short", "length [node]", by_column("term_distance"), judged)


def page_of(results: Results) -> Page:
    """Return the page of one headline claim."""
    own = {"paper": "Chen", "assumed_results": results, "headlines": [HEADLINE]}
    return own_page("assumptions", results, SETTINGS, **own)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("assumptions")
    (folder / "open.yaml").write_text(EXPERIMENT)
    experiment, outputs = smoke_experiment(str(folder / "open.yaml")), folder / "outputs"
    store(outputs, experiment)
    planned, options = experiment.num_replicates, experiment.options
    return gather(outputs, experiment.conditions, planned, "open", "smoke", "", options)


def test_every_assumed_number_stands_with_its_reason_and_its_variations(results: Results) -> None:
    page = page_of(results)
    effects, numbers = page.tables
    rows = {str(row[0]): row for row in numbers.rows}
    assert rows["`ga.num_elites`"][1:] == ("0", "–", "not printed", "one elite")
    assert rows["`scenario.obstacles[…]`"][1] == "13 values"
    assert rows["`scenario.obstacles[…]`"][4] == "a smaller map"
    assert rows["`ga.mutation_rate`"][4] == "not varied"
    assert "`ga.population_size`" not in rows  # it is printed
    assert [row[:2] for row in effects.rows] == [
        ("as assumed", "as assumed"),
        ("one elite", "`ga.num_elites`"),
        ("a smaller map", "`scenario.obstacles`"),
    ]
    assert "**contradicted**" in str(effects.rows[2][3])
    assert "**" not in str(effects.rows[1][3])
    assert CONTROLS["as assumed"] == ["as assumed, random walks"]
    assert CONTROLS["one elite"] == []


def test_a_claim_survives_where_no_variation_changes_its_verdict(results: Results) -> None:
    first, survives = page_of(results).claims
    assert (first.text, first.verdict) == ("as assumed: a short path", "reproduced")
    assert "1 of 2 variations: a smaller map (contradicted)" in survives.evidence
    assert survives.verdict == "not judged (budget smoke)"
    assert survives.n == "2 variations"


def test_the_figure_has_a_row_for_every_condition(results: Results) -> None:
    page = page_of(results)
    table = page.drawings[0].table()
    assert list(table["condition"]) == ["as assumed", "one elite", "a smaller map"]
    assert list(table["verdict"]) == ["reproduced", "reproduced", "contradicted"]
    assert len(set(table["shipped"])) == 1
    figure = page.drawings[0].draw(table)
    assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == list(
        table["condition"]
    )
