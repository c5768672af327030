"""Grid paths: what is said of them, certified moves, refusals; climbing is never worse."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.planners.grid_path_ga import planner as grid_planner
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from evoexp.planners.grid_path_ga.planner import GridPathGa
from planners.grid_samples import FIELDS, planner, robot, scenario, solvable
from planners.runs import evolved, verdict

CAPPED = PotentialFields(**FIELDS, max_unsafeness=7.0)


@pytest.fixture(autouse=True)
def _paths_of_all_generations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_planner, "KEPT", grid_planner.PER_CALL + 1)


def prepared(blocked: Any = (), size: int = 4, own: GridPathGa | None = None) -> Any:
    """Return planner and problem of a square floor with blocked nodes."""
    nodes = np.zeros((size, size), dtype=bool)
    nodes[tuple(np.array(blocked, dtype=int).reshape(-1, 2).T)] = True
    own = own or planner()
    return own, own.prepare(robot(), scenario(nodes))


def test_permitted_moves_past_corners_are_certified() -> None:
    own, problem = prepared([(1, 2), (2, 2)])
    past = np.array([[0, 0], [1, 1], [2, 1], [3, 2], [3, 3]], dtype=float).ravel()
    assert own.evaluate(problem, past)["forbidden_moves"] == 0.0
    found = verdict(own, problem, past)
    assert found.certified
    assert found.clearance == pytest.approx(np.sqrt(0.5) - 0.4, abs=0.02)
    through = np.array([[0, 2], [3, 2], [3, 3]], dtype=float).ravel()
    assert verdict(own, problem, through).certified is False


def test_evaluate_says_what_is_wrong_with_a_path() -> None:
    own, problem = prepared([(1, 1)])
    terms = own.evaluate(problem, np.array([0, 0, 1, 1, 2, 2, 3.0, 2]))
    faults = [terms[name] for name in ("blocked_nodes", "forbidden_moves", "missed_ends")]
    assert faults == [1.0, 2.0, 1.0]
    assert terms["cost"] == np.inf
    assert terms["distance"] == pytest.approx(2 * np.sqrt(2.0) + 1.0)


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ([0.0, 0.0], "path: must be two nodes at least"),
        (
            [0.0, 0.0, 0.0, 4.0],
            r"path\[1\]: must be a node .* \(0\.\.3 × 0\.\.3\), was \[0\.0, 4\.0\]",
        ),
        ([0.0, 0.0, 0.5, 1.0], r"path\[1\]: must be a node"),
        ([-1.0, 0.0, 0.0, 0.0], r"path\[0\]: must be a node"),
    ],
)
def test_evaluate_refuses_what_is_no_path(path: list[float], said: str) -> None:
    own, problem = prepared()
    with pytest.raises(SettingError, match=said):
        own.evaluate(problem, np.array(path))


@pytest.mark.parametrize("blocked", [[(3, 3), (3, 4), (4, 3)], [(3, 4), (4, 3)]])
def test_a_goal_behind_obstacles_is_said_before_any_search(blocked: list[tuple[int, int]]) -> None:
    """The gap between two corners may not be passed."""
    with pytest.raises(
        SettingError, match=r"scenario\.goal: must be a node that can be reached fr"
    ):
        prepared(blocked, size=5)


def test_start_and_goal_are_safe_enough() -> None:
    must = r"scenario\.start: must be a node of an unsafeness of at most .* \(7\), was 9"
    with pytest.raises(SettingError, match=must):
        prepared(size=5, own=planner(collision=CAPPED))


def test_the_cap_is_kept_by_all_paths() -> None:
    own, floor = planner(collision=CAPPED), np.zeros((10, 10), dtype=bool)
    problem = own.prepare(robot(), scenario(floor, start=(1, 1), goal=(8, 8)))
    for generation in evolved(own, problem):
        for path in generation.population:
            assert problem.fields.unsafeness[path[1 : path[0] + 1]].max() <= 7.0


def test_paths_of_another_kind_are_refused() -> None:
    own = planner()
    with pytest.raises(ValueError, match="paths must be"):
        own.cost(solvable((4, 4), 0.0, 0, own), np.zeros((3, 4), dtype=np.int32))


@pytest.mark.parametrize(
    "fields", [{}, {"obstacle_potentials": (2.5, 1.0)}, {"goal_potentials": (0.5, 1.75)}]
)
@pytest.mark.parametrize("revisits", [False, True])
@pytest.mark.parametrize("num_paths", [1, 3])
def test_every_path_stays_valid_and_no_generation_is_worse(
    num_paths: int, revisits: bool, fields: dict[str, tuple[float, ...]]
) -> None:
    """Whether unsafeness and weights of moves are whole numbers or not."""
    own = planner((0.1, 2.0), revisits=revisits, collision=PotentialFields(**(FIELDS | fields)))
    problem = solvable((9, 8), 0.2, 1, own)
    rows = evolved(PathClimbing(planner=own, num_paths=num_paths), problem, 2)
    counts = [own.num_evaluations(k) for k in range(own.num_generations + 1)]
    assert [one.evaluations for one in rows] == np.cumsum(counts).tolist()
    assert all((after.costs <= before.costs).all() for before, after in pairwise(rows))
    for one in rows:
        assert len(one.costs) == num_paths
        terms = own.evaluate(problem, one.best)
        assert terms["cost"] == pytest.approx(one.best_cost, rel=1e-12)
        assert own.departures(problem, one.best) == []
    assert rows[-1].best_cost < rows[0].best_cost


def test_the_first_paths_are_the_best_of_as_many_walks_as_the_planner_draws() -> None:
    own = planner((0.1, 2.0))
    problem = solvable((9, 8), 0.2, 1, own)
    first = evolved(PathClimbing(planner=own, num_paths=2), problem, 7)[0]
    drawn = own.sample(problem, np.random.default_rng(7), own.num_evaluations(0))
    np.testing.assert_array_equal(first.costs, np.sort(own.cost(problem, drawn).cost)[:2])


def test_more_paths_than_walks_and_other_planners_are_refused() -> None:
    climbing = PathClimbing(planner=planner(), num_paths=10**6)
    with pytest.raises(
        SettingError, match=r"control\.num_paths: must be at most ga\.population_si"
    ):
        climbing.prepare(robot(), scenario(np.zeros((5, 5), dtype=bool)))
    other, _ = composed("experiment=chen_placement", label="B link").prepare()
    with pytest.raises(SettingError, match="control: must be left out: placement_ga has no paths"):
        PathClimbing(planner=other, num_paths=1).prepare(None, None)
