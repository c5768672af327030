"""Goals of posture searches, allowed contacts, and scenes without obstacles."""

import re

import numpy as np
import pinocchio as pin
import pytest
from posture_samples import condition, log, postures, prepared, random_postures

from composed import composed
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.errors import EvoexpError
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import AXIAL, COLLISION, DISTANCE, HEADING, UPRIGHT
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es.kernels import COST
from evoexp.records import FloatArray

PICK, WIDE = "corsepius_pick_and_place", "corsepius_gate_wide"
PLACE = 4  # the phase that puts the bottle down


def tools(problem: object, q: FloatArray) -> FloatArray:
    """Return the tool's places by Pinocchio, (postures, 3)."""
    assembly = problem.assembly  # type: ignore[attr-defined]
    data, tool = assembly.model.createData(), assembly.tools[0]
    found = []
    for one in q.T:
        pin.forwardKinematics(assembly.model, data, np.ascontiguousarray(one))
        found.append(data.oMi[tool.joint].act(np.asarray(tool.position)))
    return np.array(found)


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_ball_around_a_point_is_met_at_its_surface(radius: float) -> None:
    _, problem = prepared(WIDE, f"scenario.phases.0.goal.radius={radius}")
    q = random_postures(problem, 300)
    rows = problem.begin(0, problem.start, problem.first_situation).judge(q).rows
    away = np.linalg.norm(tools(problem, q) - [1.35, 0.15, 0.8], axis=1)
    assert rows[DISTANCE] == pytest.approx(away - radius, abs=1e-12)


def test_a_place_is_a_disc() -> None:
    goal = "{kind: place, point: [0.4, 0.2, 0.7], radius: 0.06}"
    _, problem = prepared("corsepius_ball", f"scenario.phases=[{{name: a, goal: {goal}}}]")
    q = random_postures(problem, 300)
    rows = problem.begin(0, problem.start, problem.first_situation).judge(q).rows
    angles, radii = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 721), np.linspace(0.0, 0.06, 61))
    disc = np.column_stack(
        [0.4 + (radii * np.cos(angles)).ravel(), 0.2 + (radii * np.sin(angles)).ravel()]
    )
    disc = np.column_stack([disc, np.full(len(disc), 0.7)])
    for place, distance in zip(tools(problem, q), rows[DISTANCE], strict=True):
        assert abs(distance) == pytest.approx(
            np.linalg.norm(disc - place, axis=1).min(), abs=1.2e-3
        )


def test_of_two_grasping_angles_the_larger_one_alone_may_count() -> None:
    _, both = prepared("corsepius_bottle")
    _, larger = prepared("corsepius_bottle", "objective.grasp_angles=larger")
    q = random_postures(both, 200)
    one, two = (p.begin(0, p.start, p.first_situation).judge(q).rows for p in (both, larger))
    free = one[COLLISION] == 0.0
    assert one[:COST] == pytest.approx(two[:COST])
    assert (one[COST] - two[COST])[free] == pytest.approx(
        0.15 * np.minimum(one[AXIAL], one[HEADING])[free]
    )


def test_an_empty_scene_keeps_only_objects_that_a_goal_or_a_grasp_names() -> None:
    kept = {
        "corsepius_bottle": ("bottle",),
        WIDE: (),
        "corsepius_wall": (),
        PICK: ("bottle",),
        "corsepius_ball": ("ball",),
    }
    for name, names in kept.items():
        _, problem = prepared(name, "scenario.empty_scene=true")
        assert problem.task.names == names
        assert len(problem.obstacles.kind) == len(names)
        stage = problem.begin(0, problem.start, problem.first_situation)
        known = {*problem.bodies.names, *names}
        assert set(problem.scene_of(stage).names) == known


def test_an_empty_scene_has_the_same_goal_and_the_same_random_numbers() -> None:
    _, problem = prepared("corsepius_bottle")
    _, empty = prepared("corsepius_bottle", "scenario.empty_scene=true")
    one, two = (p.begin(0, p.start, p.first_situation).judging.aim for p in (problem, empty))
    for a, b in zip(one, two, strict=True):
        assert np.array_equal(a, b)
    first, second = (
        condition("corsepius_bottle", *more) for more in ((), ("scenario.empty_scene=true",))
    )
    assert first.rng(3).random() == second.rng(3).random()
    assert first.id != second.id


def test_a_phase_may_search_finer_than_the_others() -> None:
    planner, problem = prepared(PICK)
    found = next(log(PICK, replicate=k) for k in range(10) if log(PICK, replicate=k).summary.solved)
    spans = problem.spans(postures(found))
    path = postures(found)
    for k, span in enumerate(spans):
        steps = np.abs(np.diff(path[span.first : span.last + 1], axis=0)).max()
        assert steps <= 0.1 * (0.2 if k == PLACE else 1.0) + 1e-12
    assert planner.scope == (0.1,)


def test_what_is_put_down_stands_upright_and_no_deeper_than_allowed() -> None:
    _, problem = prepared(PICK)
    for k in range(8):
        found = log(PICK, replicate=k)
        if not found.summary.solved:
            continue
        path = postures(found)
        place = problem.spans(path)[PLACE]
        assert abs(place.judged.rows[DISTANCE, -1]) <= 0.001
        assert place.judged.rows[UPRIGHT, -1] <= 1.0 * DEGREE
        scene = problem.scene_of(place.stage)
        pairs = np.array([contact[:2] for contact in scene.contacts])
        distance = CoalDistance(scene._replace(pairs=pairs), Motion(path), 100)
        assert abs(distance(0, float(place.last))) <= 0.001
        assert found.summary.certified
        assert "table – bottle" in found.summary.allowed_contacts
        assert 0.0 <= found.summary.penetration <= 0.001 + 3e-6
        return
    raise AssertionError("no run of eight puts the bottle down")


def test_the_model_lets_the_bottle_touch_the_table_but_not_sink_into_it() -> None:
    """Postures around the release, against coal's signed distances."""
    _, problem = prepared(PICK)
    found = next(log(PICK, replicate=k) for k in range(10) if log(PICK, replicate=k).summary.solved)
    place = problem.spans(postures(found))[PLACE]
    scene, rng = problem.scene_of(place.stage), np.random.default_rng(4)
    released = postures(found)[place.last]
    q = released[:, None] + rng.uniform(-0.004, 0.004, (6, 400))
    pairs = np.array([contact[:2] for contact in scene.contacts])
    distance = CoalDistance(scene._replace(pairs=pairs), Motion(q.T.copy()), 1000)
    depths = np.array([-distance(0, float(n)) for n in range(q.shape[1])])
    rows = place.stage.judge(q).rows
    # a rim of 24 points misses its lowest point by less than .3 mm · sin of the tilt
    assert (rows[COLLISION][depths > 0.00105] == 1.0).all()
    assert (rows[COLLISION][depths < 0.0005] == 0.0).all()
    assert (depths > 0.00105).sum() > 20
    assert ((depths > 0.0001) & (depths < 0.0005)).sum() > 5


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        (
            PICK,
            ["~scenario.allowed_penetration"],
            "scenario.allowed_penetration: must be given: phases[1].contacts allows contacts, was "
            "None",
        ),
        (
            PICK,
            ["scenario.allowed_penetration=0"],
            "scenario.allowed_penetration: must be greater than 0.0, was 0",
        ),
        (
            "corsepius_wall",
            ["+scenario.phases.0.upright_tolerance=1"],
            "scenario.phases[0].upright_tolerance: must be left out in a phase whose terms do not "
            "count upright, was 1.0",
        ),
        (
            PICK,
            ["scenario.phases.4.scope_share=2"],
            "scenario.phases[4].scope_share: must be at most 1.0, was 2",
        ),
    ],
)
def test_refusals_of_contacts_and_tolerances(name: str, overrides: list[str], message: str) -> None:
    with pytest.raises(EvoexpError, match=re.escape(message)) as found:
        composed(f"experiment={name}", *overrides).prepare()
    assert "\n" not in str(found.value)
