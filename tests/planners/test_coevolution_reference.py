"""The compiled co-evolution against the same algorithm in numpy, from the same uniform numbers.

Genes are copied, exchanged and added to, so as long as both take the same decisions (who is drawn,
who collides, who is on a front) their populations are equal bit for bit. Only sines and cosines
differ in the last digit, and with them costs.
"""

import json
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.records import generations
from references import curkovic_numpy

ROUNDING = 1e-12  # relative, of costs; measured: 5e-15
METHODS, THREE = ("I", "II", "III", "IV", "V", "VI", "VII", "VIII"), "curkovic_three"
DISC = {"shape": "sphere", "center": [0.2, 0.45], "radius": 0.05}
DISCS = [DISC, {"shape": "sphere", "center": [0.6, 0.25], "radius": 0.04}]
SMALL: dict[str, Any] = {"ga.population_size": 16, "ga.num_generations": 25, "ga.hall_depth": 0.25}


def condition(
    changes: dict[str, Any], experiment: str = "curkovic_methods", label: str = "V"
) -> Condition:
    """Return a shipped condition with some settings changed, in the canonical form's words."""
    config = json.loads(composed(f"experiment={experiment}", label=label).to_json())
    for path, value in changes.items():
        *parents, name = (path if "." in path else f"planner.{path}").split(".")
        inner = config if parents[0] in config else config["planner"]
        for parent in parents:
            inner = inner[parent]
        inner[name] = value
    return Condition.from_config(config)


def compare(given: Condition, seed: int) -> dict[str, int]:
    """Fail where a generation differs.

    Returns:
        Numbers of collisions, contacts with obstacles, feasible individuals and restarts: where
        they are 0, the comparison says nothing of them.
    """
    planner, problem = given.prepare()
    ours = generations(planner.evolve(problem, np.random.default_rng(seed)))
    slow = curkovic_numpy.from_condition(given)
    theirs = curkovic_numpy.evolve(slow, np.random.default_rng(seed))
    events = {"collisions": 0, "contacts": 0, "feasible": 0, "restarts": 0}
    best = np.inf
    for found, expected in zip(ours, theirs, strict=True):
        judged = expected.judged
        assert np.array_equal(found.population, expected.populations), found.index
        np.testing.assert_allclose(found.costs, judged.costs, rtol=ROUNDING)
        assert found.num_feasible == expected.num_feasible
        assert found.best_cost_in_generation == pytest.approx(expected.best_cost, rel=ROUNDING)
        best = min(best, expected.best_cost)
        assert found.best_cost == pytest.approx(best, rel=ROUNDING)
        events["collisions"] += sum(int(table.sum()) for table in judged.hits.values())
        events["contacts"] += int(judged.blocked.sum())
        events["feasible"] += expected.num_feasible
        events["restarts"] += expected.restarted
    assert found.criteria is not None
    np.testing.assert_allclose(found.criteria, judged.criteria, rtol=ROUNDING, atol=ROUNDING)
    return events


@pytest.mark.examples(4)
@pytest.mark.parametrize("method", METHODS)
def test_the_papers_methods_agree(method: str) -> None:
    events = compare(condition({"ga.num_generations": 15}, label=method), 0)
    assert events["collisions"] > 0
    assert events["feasible"] > 0


@pytest.mark.parametrize(
    "changes",
    [
        {"ga.num_elites": 3},
        {"ga.mutation_direction": "symmetric"},
        {"ga.selection": "difference"},
        {"ga.hall_memory": 2},
        {"ga.hall_frozen": True},
        {"ga.hall_distinct": "index"},
        {"ga.hall_distinct": "index", "ga.hall_memory": 2},
        {"ga.hall_distinct": "index", "ga.hall_frozen": True},
        {"ga.hall_members": "front"},
        {"ga.hall_members": "front", "ga.hall_depth": 1.0},
        {"collision.collision_substeps": 3},
        {"chromosome_length": 2},
        {"ga.population_size": 13, "ga.crossover_rate": 1.0},
        {"ga.population_size": 13, "ga.num_elites": 9},
        {"ga.num_generations": 0},
        {"objective.collision_weight": 0.5, "objective.path_weight": 2.0},
        {"objective.rotation_weight": 0.3, "objective.evenness_weight": 4.0},
        {"scenario.obstacles": DISCS},
    ],
    ids=lambda changes: " ".join(changes),
)
def test_variants_agree(changes: dict[str, Any]) -> None:
    for seed in range(2):
        events = compare(condition(SMALL | changes), seed)
        assert events["collisions"] > 0
        assert (events["contacts"] > 0) is ("scenario.obstacles" in changes)


@pytest.mark.examples(2)
@pytest.mark.parametrize("discs", [[], [DISC]], ids=["free", "beside a disc"])
@pytest.mark.parametrize("label", ["configurations only", "5 substeps"])
def test_three_robots_agree(label: str, discs: list[Any]) -> None:
    changes = SMALL | {"ga.num_elites": 1, "scenario.obstacles": discs}
    events = compare(condition(changes, THREE, label), 3)
    assert events["collisions"] > 0
    assert events["feasible"] > 0
    assert (events["contacts"] > 0) is bool(discs)


@pytest.mark.parametrize(
    "hall", [{}, {"ga.hall_distinct": "index"}, {"ga.hall_members": "front"}], ids=str
)
def test_a_robot_that_stands_still_agrees(hall: dict[str, Any]) -> None:
    changes = SMALL | hall
    compare(condition(changes, "curkovic_stationary", "configurations only"), 0)


def test_restarts_agree() -> None:
    """Two individuals rarely make a team: fresh populations are drawn, the hall is emptied."""
    changes = {"ga.population_size": 2, "ga.hall_depth": 0.5, "ga.restart_after": 2}
    three = condition(changes | {"ga.num_generations": 40}, THREE, "5 substeps")
    assert sum(compare(three, seed)["restarts"] for seed in range(3)) > 3
