"""Results as logs hold them, parameters with sources, and all pairs of conditions in tables."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from composed import alone, composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.search_path import options
from evoexp.errors import NothingStored
from evoexp.report.pages import markdown, page_values
from evoexp.report.pages.index import document
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import parameters
from evoexp.report.results.parameters import Parameter, option, overridden
from evoexp.report.results.stored_results import ConditionResults, Results, gather
from evoexp.report.statistics.inference import holm
from evoexp.shipped import Option
from evoexp.store.identity import Plan
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from matrix import examples
from report_samples import expand, page_settings, store
from shipped_conditions import EXAMPLES


def gathered(outputs: Path, count: int | None, *overrides: str) -> Results:
    conditions = expand("rana_planar", *overrides).conditions
    return gather(outputs, conditions, count, "rana_planar", "smoke", "evoexp run it")


def test_nothing_stored_is_one_line_with_the_command(tmp_path: Path) -> None:
    line = r"^rana_planar: nothing stored in .*; try: evoexp run it$"
    with pytest.raises(NothingStored, match=line):
        gathered(tmp_path, 2)
    assert not list(tmp_path.iterdir())


def test_results_are_what_the_logs_hold(stored: Path, results: Results) -> None:
    labels = {c.label: c.is_control for c in results.conditions}
    assert labels == {"via-point GA": False, "random search": True, "multi-start": True}
    ga = results.conditions[0]
    assert (ga.done, ga.planned, ga.failures) == (2, 2, {}) and results.main == (ga,)
    run = RunDirectory(stored, ga.condition.id)
    assert Condition.from_json(run.config_json()) == ga.condition
    logs = [read_log(run.log_path(k)) for k in range(2)]
    costs = [log.summary.best_cost for log in logs]
    assert list(ga.column("best_cost")) == costs
    assert costs[ga.best_replicate] == min(costs)
    solutions = logs[ga.best_replicate].solutions
    np.testing.assert_array_equal(ga.solutions[ga.best_replicate], solutions[-1].values)
    np.testing.assert_array_equal(ga.first_solution(ga.best_replicate), solutions[0].values)
    assert len(ga.generations) == sum(len(log.generations) for log in logs)
    assert ga.code["version"] == run.manifest()["versions"]["evoexp"]
    assert math.isnan(ga.column("no such column")[0])


def test_replicates_asked_for_when_results_were_there_are_told_apart(tmp_path: Path) -> None:
    experiment = expand("rana_planar", "num_replicates=1", "ga.num_generations=1")
    ga = experiment.conditions[0].condition
    run = RunDirectory(tmp_path, ga.id)
    run.note_plan(1)
    store(tmp_path, experiment)
    run.note_plan(1)  # the same again, and fewer, are no other plan
    assert run.plans() == [Plan(1, 0)]
    run.note_plan(3)
    assert run.plans() == [Plan(1, 0), Plan(3, 1)]
    run.write_logs({k: run_replicate(ga, k).content for k in (1, 2)})
    found = gather(tmp_path, experiment.conditions, 1, "", "", "").conditions[0]
    assert (found.done, found.planned) == (3, 3)
    # the experiment's own number was fixed before
    assert [found.added(fixed=fixed) for fixed in (1, 2, 3)] == [2, 1, 0]
    parts = Page("title", ""), Results("", "", (found,)), page_settings("", "generic")
    text = markdown.page(document(*parts, "evoexp report", {}))
    assert f"**Replicates added later.** {found.label}: 2 of 3" in text


def test_failed_and_missing_replicates_are_counted(tmp_path: Path) -> None:
    experiment = expand("rana_planar", "num_replicates=1", "ga.num_generations=1")
    store(tmp_path, experiment)
    ga, search, _ = (RunDirectory(tmp_path, c.condition.id) for c in experiment.conditions)
    ga.write_failure(1, "worker died", "traceback")
    search.log_path(0).unlink()
    found = gather(tmp_path, experiment.conditions, 3, "rana_planar", "smoke", "")
    first, second, third = found.conditions
    assert (first.done, first.failures) == (1, {1: "worker died"})
    assert (second.done, second.failures, second.solutions) == (0, {}, {})
    assert found.with_data == (first, third)


def changed(condition: ConditionResults, label: str, **columns: object) -> ConditionResults:
    summaries = condition.summaries.assign(**columns)
    return dataclasses.replace(condition, label=label, summaries=summaries)


def copies(results: Results, count: int) -> Results:
    """Return results of some conditions, each of which costs more than the one before."""
    first = results.conditions[0]
    costs, slope = first.column("best_cost"), 1.0 + 0.1 * np.arange(first.done)
    conditions = (changed(first, f"+{k}", best_cost=costs + k * slope) for k in range(count))
    return results._replace(conditions=tuple(conditions))


@pytest.mark.parametrize(("count", "rows"), [(4, 6), (6, 15), (7, 6)])
def test_every_pair_is_compared_and_of_many_conditions_the_first_with_each(
    results: Results, settings: ReportSettings, count: int, rows: int
) -> None:
    found = copies(results, count)
    (_, costs), *_ = page_values.pairs_of_conditions(found, settings, page_values.differing(found))
    assert len(costs) == len({row.quantity for row in costs}) == rows
    assert [row.p_adjusted for row in costs] == holm([row.better.p_value for row in costs])
    assert all(row.better.a12 > 0.5 for row in costs)  # the first of a pair costs less


def test_a_quantity_that_never_differs_is_left_out(results: Results) -> None:
    names = page_values.differing(results._replace(conditions=results.conditions[:1] * 2))
    assert "evaluations" not in names and "best cost" in names  # of two seeds


def test_shares_that_differ_are_tested_pair_by_pair(results: Results) -> None:
    first = results.conditions[0]
    some, none = changed(first, "all", solved=True), changed(first, "none", solved=False)
    both = results._replace(conditions=(some, none))
    shares = [page_values.SHARES["solved"](c).with_interval(0.95) for c in (some, none)]
    assert shares == ["2 of 2 = 100 % [34, 100]", "0 of 2 = 0 % [0, 66]"]
    (row,) = (row for row in page_values.difference_rows(both, 0.95) if row[0] == "solved")
    assert row[1:3] == ("all against none", "100 [7, 100]")
    assert float(str(row[3])) == pytest.approx(1.0 / 3.0, abs=0.01)  # 2 of 6 tables
    assert not [*page_values.difference_rows(results._replace(conditions=(some,)), 0.95)]


def test_the_generic_page_holds_all_of_it(results: Results, settings: ReportSettings) -> None:
    page = own_page("generic", copies(results, 4), settings)
    names = ("best cost", "CPU time, search [s]")  # all took as many evaluations
    headings = [heading for heading, _ in page.comparisons]
    assert headings == [f"{name}: pairs of conditions" for name in names]
    stems = ["scene", "convergence", "values", "joints", "covers"]
    assert [drawing.stem for drawing in page.drawings] == stems
    assert page.tables[0].headers == ("condition", "solved", "certified", "required margin kept")
    assert {"best cost", "CPU time of the search"} <= {q.name for q in page.quantities}


EXPERIMENTS = examples(options("experiment"), lambda name: name in dict(EXAMPLES))


def rows_of(
    condition: Condition,
    taken: tuple[Option, ...] = (),
    planned: int = 20,
    experiment: str = "",
    budget: str = "",
) -> dict[str, Parameter]:
    """Return the parameters of a condition that nobody ran, by name."""
    found = ConditionResults("", condition, planned, None, {}, None, {}, taken)
    rows = parameters.parameters(Results(experiment, budget, (found,)), found)
    assert len({row.name for row in rows}) == len(rows)
    return {row.name: row for row in rows}


def of(
    *overrides: str, name: str = "rana_planar", budget: str = "paper", label: int = 0
) -> dict[str, Parameter]:
    experiment = alone(f"experiment={name}", f"budget={budget}", *overrides, label=label)
    ((text, condition),) = experiment.conditions
    return rows_of(condition, experiment.options[text], experiment.num_replicates, name, budget)


def test_values_units_and_sources_come_from_options_and_comments() -> None:
    rows, other = of(), of("scenario=rana_obstacles")
    planner, options = "via_point_ga, revision 1", "conf/planner/rana_planar.yaml"
    for name, *expected in (
        ("ga.population_size", "50", "", "paper: Tab. 1, population"),
        ("objective.length_weight", "0.5", "1/deg", "paper: Tab. 1, k1"),
        ("planner", planner, "", options),
    ):
        assert list(rows[name][1:]) == expected
    assert rows["scenario.q_goal[0]"][1:3] == ("[135.0, 135.0]", "deg")
    assert rows["planner.num_via_points"].source.startswith("assumed: ")
    assert rows["seed"].source.startswith("assumed")
    assert rows["num_replicates"].value == "200"
    # another option than the experiment's own
    assert other["scenario"].source == "conf/scenario/rana_obstacles.yaml"
    assert other["scenario.obstacles[1].size"][1:] == ("[0.8, 0.8]", "unit", "assumed")
    assert other["scenario.q_start[0]"].source.startswith("paper: Tab. 2")


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_number_of_the_shipped_experiments_has_a_source(name: str) -> None:
    rows = of(name=name)
    numbers = [row for row in rows.values() if any(letter.isdigit() for letter in row.value)]
    assert len(numbers) > 20
    assert [row.name for row in numbers if not row.source] == []
    # what their first conditions are there for
    swept = {"curkovic_hall": ["ga.hall_depth"]}
    assert overridden(rows.values()) == swept.get(name, [])


def test_overrides_and_budgets_are_told_apart() -> None:
    rows = of("ga.population_size=20", "seed=3", budget="smoke")
    assert rows["ga.population_size"][1:] == ("20", "", "override")
    assert rows["ga.num_generations"][1:] == ("10", "", "budget smoke")
    assert rows["num_replicates"].source == "budget smoke"
    assert rows["ga.crossover_rate"].source == "paper: Tab. 1, cross_over_probability"
    assert rows["seed"].source == "override"
    assert sorted(overridden(rows.values())) == ["ga.num_generations", "ga.population_size"]


def test_options_that_nothing_records_are_named_as_such() -> None:
    rows = rows_of(composed("experiment=rana_three_arms"))
    assert rows["robot"].source == parameters.NOT_RECORDED
    assert rows["robot.arms[2].base_position"].source == parameters.NOT_RECORDED


def test_the_option_that_was_taken_is_named_though_another_one_is_alike(tmp_path: Path) -> None:
    experiment = compose.expand(["experiment=rana_planar"])[0]
    label, condition = experiment.conditions[0]
    (shipped,) = (each for each in experiment.options[label] if each.group == "ga")
    others = tuple(each for each in experiment.options[label] if each.group != "ga")
    mine = tmp_path / "mine.yaml"
    mine.write_text(Path(shipped.path).read_text().replace("paper: Tab. 1, pop", "mine: pop"))
    taken = shipped._replace(name="mine", origin="my-planner 0.3", path=str(mine))
    for each, source in ((taken, "mine: population"), (taken._replace(path=""), None)):
        rows = rows_of(condition, (*others, each), 20, "rana_planar", "paper")
        assert rows["ga"].source == "my-planner 0.3: ga/mine.yaml"
        assert rows["ga.population_size"].source == (source or rows["ga"].source)
        assert rows["planner"].source == "conf/planner/rana_planar.yaml"


def test_a_control_is_a_component_of_its_own() -> None:
    rows = of(label=1)
    assert rows["control"].value.startswith("random_search")
    assert rows["ga.population_size"].source.startswith("paper")
    assert "planner.planner" not in rows


def test_an_option_file_is_read_with_its_comments_and_those_that_it_takes_in(
    tmp_path: Path,
) -> None:
    (tmp_path / "ga").mkdir()
    (tmp_path / "ga/base.yaml").write_text(
        "_target_: x\nrate: 1e-3  # [1/s] paper: Tab. 1\nsize: 3  # [m] assumed: seen\n"
    )
    (tmp_path / "ga/own.yaml").write_text(
        "defaults:\n  - rana_planar\n  - base\n  - _self_\nsize: 4  # [m] paper: p. 2\n"
        'name: "a # b"  # a note\nlist:\n  - [1, 2]\n'
    )
    entries = option(tmp_path / "ga/own.yaml")
    assert entries["size"] == (4, "m", "paper: p. 2")
    assert entries["rate"][1:] == ("1/s", "paper: Tab. 1")
    assert entries["name"] == ("a # b", "", "a note")
    assert entries["list[0]"] == ([1, 2], "", "")
    assert entries["crossover_rate"].source.startswith("paper: Tab. 1")  # a shipped option


def test_planned_replicates_are_those_without_a_cap() -> None:
    assert parameters.planned_replicates(Results("rana_planar", "smoke", ())) == 200
    assert parameters.planned_replicates(Results("", "", ())) == 20
