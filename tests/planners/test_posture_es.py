"""Searches for postures: against a slow search, by phases, and what the answers are."""

import functools
import itertools
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.cli import main
from evoexp.collision.certifier.certificate import combined, judged_part
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.condition import Condition
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import COLLISION, DISTANCE, UPRIGHT
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es.planner import dense
from evoexp.records import FloatArray, generations
from evoexp.store.log_reader import LogContents, read_log
from planners.runs import verdict
from references import posture_es_python

BALL, WALL, SHELF = "corsepius_ball", "corsepius_wall", "corsepius_shelf"
PICK = "corsepius_pick_and_place"
LIFT, CARRY, PLACE, DETACH = 2, 3, 4, 5  # phases of pick and place


def condition(words: str, label: int = 0) -> Condition:
    return composed(*f"experiment={words}".split(), label=label)


@functools.cache
def log(words: str, replicate: int = 0, label: int = 0) -> LogContents:
    return read_log(run_replicate(condition(words, label), replicate).content)


def postures(words: str, replicate: int = 0) -> FloatArray:
    """Return the path of a replicate, (postures, nq)."""
    return log(words, replicate).solutions[-1].values.reshape(-1, 6)


@pytest.mark.examples(6)
@pytest.mark.parametrize(
    "words",
    [
        BALL,
        "corsepius_bottle",
        SHELF,
        f"{SHELF} planner.edge_check=3",
        f"{WALL} ga.selection=plus ga.patience=5",
        f"{BALL} ga.mutation=gaussian ga.parent_choice=gaussian",
        f"{BALL} ga.crossover_rate=0.5 ga.initial_size=30",
        f"{WALL} ga.num_immigrants=40 ga.num_generations=8 ga.num_parents=9",
        f"{SHELF} ga.crossover_rate=0.3 ga.num_immigrants=5 planner.edge_check=1",
        PICK,
        f"{BALL} ga.num_generations=0",
        f"{PICK} ga.initial_size=30 ga.num_immigrants=2 ga.mutation=gaussian",
    ],
)
def test_generations_are_those_of_the_slow_search(words: str) -> None:
    given = condition(words)
    (planner, problem), rng, slow_rng = given.prepare(), given.rng(0), given.rng(0)
    expected = posture_es_python.cycles(problem, planner, slow_rng)
    found = generations(planner.evolve(problem, rng))
    for ours, theirs in itertools.zip_longest(found, expected):
        searched_last = ours.terms["phase"] == len(problem.phases)
        is_goal = theirs.reason == "goal"
        finite = theirs.costs[theirs.feasible & np.isfinite(theirs.costs)]
        assert rng.bit_generator.state == slow_rng.bit_generator.state
        assert np.array_equal(ours.population, theirs.postures)
        assert np.array_equal(np.ravel(ours.costs), theirs.costs)
        assert np.array_equal(ours.best, np.ravel(theirs.best))
        assert ours.best_cost == (theirs.best_cost if searched_last else np.inf)
        assert ours.num_feasible == np.count_nonzero(theirs.feasible)
        assert not finite.size or ours.mean_cost == pytest.approx(finite.mean(), rel=1e-12)
        assert ours.evaluations == theirs.evaluations
        assert ours.solved == (searched_last and is_goal)
        assert ours.stop_reason == ("" if is_goal and not searched_last else theirs.reason)


def test_immigrants_descend_from_the_nearest_member_and_their_steps_are_reported() -> None:
    words = f"{WALL} ga.num_immigrants=200 planner.scope=0.02 ga.num_generations=20"
    terms = log(words).summary.terms
    steps = (np.abs(np.diff(postures(words), axis=0)) / 0.02).max(axis=1)
    assert terms["oversized_steps"] == np.count_nonzero(steps > 1.0 + 1e-9) > 0
    assert terms["longest_step_scopes"] == pytest.approx(steps.max())


class Carried(NamedTuple):
    """A replicate of pick-and-place that succeeds."""

    planner: Any
    problem: Any
    contents: LogContents
    solution: FloatArray
    spans: Any  # of each phase

    @property
    def path(self) -> FloatArray:
        """The postures, (postures, nq)."""
        return self.solution.reshape(-1, 6)


@pytest.fixture(scope="module")
def carried() -> Carried:
    contents = next(log(PICK, k) for k in range(10) if log(PICK, k).summary.solved)
    (planner, problem), solution = condition(PICK).prepare(), contents.solutions[-1].values
    return Carried(planner, problem, contents, solution, problem.spans(solution.reshape(-1, 6)))


def test_phases_follow_each_other_in_one_motion(carried: Carried) -> None:
    names = [span.stage.phase.name for span in carried.spans]
    assert names == ["approach", "grasp", "lift", "carry", "place", "detach"]
    ends = [int(carried.contents.summary.terms[f"phase_{k + 1}_end"]) for k in range(6)]
    assert ends == sorted(ends) and ends[-1] == len(carried.path) - 1
    rows = carried.contents.generations
    phases = [row.terms["phase"] for row in rows]
    assert phases == sorted(phases) and set(phases) == {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}
    assert rows[-1].evaluations == 100 * rows[-1].terms["cycles"] + 6
    assert carried.planner.motion(carried.problem, carried.solution).num_segments == ends[-1]
    for k, span in enumerate(carried.spans):  # a phase may search finer than the others
        steps = np.abs(np.diff(carried.path[span.first : span.last + 1], axis=0)).max()
        assert steps <= 0.1 * (0.2 if k == PLACE else 1.0) + 1e-12


def test_what_is_held_moves_with_the_tool_and_stays_where_it_is_left(carried: Carried) -> None:
    lift, place, detach = (carried.spans[k] for k in (LIFT, PLACE, DETACH))
    assert lift.stage.situation.held == carried.problem.task.names.index("bottle")
    bottle = detach.stage.situation.poses[lift.stage.situation.held]
    assert np.abs(bottle[9:] - [0.52, -0.22, 0.625]).max() <= 0.01
    assert np.arccos(bottle[8]) <= 10.0 * DEGREE
    assert place.judged.met[-1]
    assert detach.stage.situation.held == -1
    # it stands upright, no deeper in the table than allowed
    assert abs(place.judged.rows[DISTANCE, -1]) <= 0.001
    assert place.judged.rows[UPRIGHT, -1] <= 1.0 * DEGREE
    summary = carried.contents.summary
    assert summary.certified
    assert "table – bottle" in summary.allowed_contacts
    assert 0.0 <= summary.penetration <= 0.001 + 3e-6


def test_the_model_lets_the_bottle_touch_the_table_but_not_sink_into_it(carried: Carried) -> None:
    """Postures around the release, against coal's signed distances."""
    place = carried.spans[PLACE]
    scene, rng = carried.problem.scene_of(place.stage), np.random.default_rng(4)
    q = carried.path[place.last][:, None] + rng.uniform(-0.004, 0.004, (6, 400))
    pairs = np.array([contact[:2] for contact in scene.contacts])
    distance = CoalDistance(scene._replace(pairs=pairs), Motion(q.T.copy()), 1000)
    depths = np.array([-distance(0, float(n)) for n in range(q.shape[1])])
    collides = place.stage.judge(q).rows[COLLISION]
    # a rim of 24 points misses its lowest point by less than .3 mm · sin of the tilt
    assert (collides[depths > 0.00105] == 1.0).all()
    assert (collides[depths < 0.0005] == 0.0).all()
    assert (depths > 0.00105).sum() > 20
    assert ((depths > 0.0001) & (depths < 0.0005)).sum() > 5


def test_the_tilt_stays_within_its_limit_also_between_postures(carried: Carried) -> None:
    """Between two postures of at most L a tilt passes L by at most (6 × .1)²/8."""
    terms = carried.planner.evaluate(carried.problem, carried.solution)
    at, between = terms["greatest_upright_deg"], terms["greatest_upright_between_deg"]
    assert 0.0 < at <= 10.0
    assert at <= between <= 10.0 + 0.045 / DEGREE
    for span in carried.spans[LIFT:DETACH]:
        rows = span.stage.judge(dense(carried.path[span.first : span.last + 1])).rows
        assert rows[UPRIGHT].max() <= 10.0 * DEGREE + 0.045


def test_every_phase_is_certified_with_its_own_bodies(carried: Carried) -> None:
    motion = carried.planner.motion(carried.problem, carried.solution)
    parts = carried.planner.parts(carried.problem, motion)
    assert [part.first for part in parts[1:]] == [part.last for part in parts[:-1]]
    each = [judged_part(part, motion, 0.0) for part in parts]
    together = verdict(carried.planner, carried.problem, carried.solution)
    assert together == combined(each)
    assert together.certified is all(one.certified for one in each)
    assert together.clearance == min(one.clearance for one in each)
    scenes = [part.scene for part in parts]
    names = [{frozenset(s.pair_names(k)) for k in range(len(s.pairs))} for s in scenes]
    assert frozenset(("bottle", "table")) not in names[LIFT] | names[PLACE]
    assert {frozenset((own, "bottle")) for own in ("table", "column")} <= names[CARRY]
    assert [frozenset(("hand", "bottle")) in own for own in names[:2]] == [True, False]


def test_fast_collisions_of_all_phases_miss_nothing_that_coal_sees(carried: Carried) -> None:
    low, high = carried.problem.limits.T
    q = np.random.default_rng(0).uniform(low, high, (400, 6)).T
    for span in carried.spans:
        scene, found = carried.problem.scene_of(span.stage), span.stage.judge(q).rows[COLLISION]
        data, placed = scene.model.createData(), scene.geometry.createData()
        touches = [
            pin.computeCollisions(scene.model, data, scene.geometry, placed, one.copy(), True)
            for one in q.T
        ]
        assert (found[np.array(touches)] == 1.0).all()


def test_every_term_of_every_posture_is_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planner, problem = condition("corsepius_bottle").prepare()
    path = postures("corsepius_bottle")
    names, rows = planner.listing(problem, path.ravel())
    assert len(rows) == len(path)
    assert names[:4] == ["posture", "phase", "goal_distance", "axial_approach_rad"]
    last, terms = dict(zip(names, rows[-1], strict=True)), planner.evaluate(problem, path.ravel())
    compared = ("goal_distance", "axial_approach_rad", "heading_rad", "cost")
    assert [last[name] for name in compared] == [terms[name] for name in compared]
    assert last["step_scopes"] == pytest.approx(np.abs(path[-1] - path[-2]).max() / 0.1)
    file = tmp_path / "path.json"
    file.write_text(json.dumps(path.tolist()))
    assert main(["evaluate", str(file), "experiment=corsepius_bottle", "--json"]) == 0
    printed, *_ = json.loads(capsys.readouterr().out)  # and the experiment's other conditions
    assert len(printed["rows"]) == len(path)
    assert printed["rows"][-1]["step_scopes"] == last["step_scopes"]
