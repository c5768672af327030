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
from report_samples import expand
from shipped_conditions import EXAMPLES

EXPERIMENTS = examples(options("experiment"), lambda name: name in dict(EXAMPLES))


def nobodys(
    label: str, condition: Condition, options: tuple[Option, ...] = (), planned: int = 20
) -> ConditionResults:
    """Return a condition that nobody ran."""
    return ConditionResults(label, condition, planned, None, {}, None, {}, options)  # type: ignore[arg-type]


def of(
    *overrides: str, name: str = "rana_planar", budget: str = "paper", label: int = 0
) -> dict[str, Parameter]:
    """Return the parameters of a condition that nobody ran, by name."""
    experiment = alone(f"experiment={name}", f"budget={budget}", *overrides, label=label)
    ((text, condition),) = experiment.conditions
    found = nobodys(text, condition, experiment.options[text], experiment.num_replicates)
    rows = parameters.parameters(Results(name, budget, (found,)), found)
    assert len({row.name for row in rows}) == len(rows)
    return {row.name: row for row in rows}


def test_units_and_sources_come_from_the_comments() -> None:
    rows = of()
    assert rows["ga.population_size"] == (
        "ga.population_size",
        "50",
        "",
        "paper: Tab. 1, population",
    )
    assert rows["scenario.q_goal[0]"].unit == "deg"
    assert rows["scenario.q_goal[0]"].value == "[135.0, 135.0]"
    assert rows["objective.length_weight"][1:] == ("0.5", "1/deg", "paper: Tab. 1, k1")
    assert rows["planner.num_via_points"].source.startswith("assumed: ")
    assert rows["planner"] == (
        "planner",
        "via_point_ga, revision 1",
        "",
        "conf/planner/rana_planar.yaml",
    )
    assert rows["seed"].source.startswith("assumed")
    assert rows["num_replicates"].value == "20"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_number_of_the_shipped_experiments_has_a_source(name: str) -> None:
    rows = of(name=name)
    numbers = [row for row in rows.values() if any(character.isdigit() for character in row.value)]
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


def test_another_option_than_the_experiments_own_is_recognised() -> None:
    rows = of("scenario=rana_obstacles")
    assert rows["scenario"].source == "conf/scenario/rana_obstacles.yaml"
    assert rows["scenario.obstacles[1].size"] == (
        "scenario.obstacles[1].size",
        "[0.8, 0.8]",
        "unit",
        "assumed",
    )
    assert rows["scenario.q_start[0]"].source.startswith("paper: Tab. 2")


def test_options_that_nothing_records_are_those_that_settings_are_most_like() -> None:
    condition = composed("experiment=rana_three_arms")
    found = nobodys("", condition)
    rows = {row.name: row for row in parameters.parameters(Results("", "", (found,)), found)}
    assert rows["robot"].source == "most like conf/robot/three_planar_2r.yaml"
    assert rows["robot.arms[2].base_position"].unit == "unit"


def test_the_option_that_was_taken_is_named_though_another_one_is_alike(tmp_path: Path) -> None:
    experiment = compose.expand(["experiment=rana_planar"])[0]
    label, condition = experiment.conditions[0]
    (tmp_path / "ga").mkdir()
    shipped = next(each for each in experiment.options[label] if each.group == "ga")
    mine = tmp_path / "ga" / "mine.yaml"
    mine.write_text(Path(shipped.path).read_text().replace("paper: Tab. 1, pop", "mine: pop"))
    taken = shipped._replace(name="mine", origin="my-planner 0.3", path=str(mine))
    others = tuple(each for each in experiment.options[label] if each.group != "ga")
    for each, unit_source in ((taken, "mine: population"), (taken._replace(path=""), None)):
        found = nobodys(label, condition, (*others, each))
        rows = parameters.parameters(Results("rana_planar", "paper", (found,)), found)
        named = {row.name: row for row in rows}
        assert named["ga"].source == "my-planner 0.3: ga/mine.yaml"
        assert named["ga.population_size"].source == (unit_source or named["ga"].source)
        assert named["planner"].source == "conf/planner/rana_planar.yaml"


def test_an_option_takes_in_shipped_ones_from_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "ga").mkdir()
    own = tmp_path / "ga" / "own.yaml"
    own.write_text("defaults:\n  - rana_planar\n  - _self_\npopulation_size: 7  # [-] mine\n")
    entries = option(own)
    assert entries["population_size"] == (7, "", "mine")
    assert entries["crossover_rate"].source.startswith("paper: Tab. 1")


def test_a_control_is_a_component_of_its_own() -> None:
    rows = of(label=1)
    assert rows["control"].value.startswith("random_search")
    assert rows["ga.population_size"].source.startswith("paper")
    assert "planner.planner" not in rows


def test_an_option_file_is_read_with_its_comments(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(
        "_target_: x\nrate: 1e-3  # [1/s] paper: Tab. 1\nsize: 3  # [m] assumed: seen\n"
    )
    text = (
        'defaults:\n  - base\n  - _self_\nsize: 4  # [m] paper: p. 2\nname: "a # b"  # a '
        "note\nlist:\n  - [1, 2]\n"
    )
    (tmp_path / "own.yaml").write_text(text)
    entries = option(tmp_path / "own.yaml")
    assert entries["size"] == (4, "m", "paper: p. 2")
    assert entries["rate"][1:] == ("1/s", "paper: Tab. 1")
    assert entries["name"] == ("a # b", "", "a note")
    assert entries["list[0]"] == ([1, 2], "", "")


def test_planned_replicates_are_those_without_a_cap() -> None:
    assert parameters.planned_replicates(Results("rana_planar", "smoke", ())) == 20
    assert parameters.planned_replicates(Results("", "", ())) == 20
    assert expand("rana_planar").num_replicates == 2
