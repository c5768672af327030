from pathlib import Path

import pytest

from composed import alone, composed
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.search_path import options
from evoexp.report.results import parameters
from evoexp.report.results.parameters import Parameter, option, overridden
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.shipped import Option
from matrix import examples
from shipped_conditions import EXAMPLES

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
    swept = {"curkovic_hall": ["ga.hall_depth"], "arena_tuning": ["planner.walk_step"]}
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
