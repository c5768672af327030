"""The shipped problems of MotionBenchMaker: valid ends on exact bodies, of robots of known size."""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

import evoexp
from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners import arm_tasks as tasks
from evoexp.testing import conditions

ASSETS = Path(evoexp.__file__).parent / "assets" / "motionbenchmaker"
BOX = ASSETS / "problems" / "box_panda"
VIA_POINTS = (
    *("robot=panda", "scenario=moveit", "planner=via_points", "ga=via_points"),
    *("objective=via_points", "collision=covered_bodies"),
)
POSTURES = (
    *("experiment=motionbenchmaker", "planner=posture_es_fine", "planner.scope=[0.03]"),
    *("ga=corsepius", "ga.patience=100", "ga.num_generations=1000"),
    *("objective=corsepius_pose", "collision=corsepius_spheres"),
)


@pytest.fixture(scope="module")
def shipped() -> dict[str, Condition]:
    return conditions("experiment=motionbenchmaker")


def test_a_problem_of_every_scene_with_both_robots(shipped: dict[str, Condition]) -> None:
    scenes = {label.rpartition("_")[0] for label in shipped}
    assert len(scenes) == 7
    assert set(shipped) == {f"{scene}_{robot}" for scene in scenes for robot in ("panda", "ur5")}
    total = sum(path.stat().st_size for path in ASSETS.rglob("*") if path.is_file())
    assert total <= 2_000_000
    assert (ASSETS / "NOTICE").is_file()


@pytest.mark.parametrize("robot", ["panda", "ur5"])
def test_starts_and_goals_are_free_on_exact_bodies(
    robot: str, shipped: dict[str, Condition]
) -> None:
    """By coal, without any of evoexp's tables; and a body moved to the hand is found."""
    for each in (each for label, each in shipped.items() if label.endswith(robot)):
        _, problem = each.prepare()
        assembly, ends = problem.assembly, (problem.start, problem.goal)
        bodies = problem.scene._replace(geometry=problem.scene.geometry.copy())
        tasks.check_limits(assembly, ends)
        assert len(bodies.pairs) > 50
        data, placed = bodies.model.createData(), bodies.geometry.createData()
        for q in ends:
            found = pin.computeCollisions(
                bodies.model, data, bodies.geometry, placed, np.deg2rad(q), False
            )
            assert not found
        # an obstacle brought to where the last body is touches it
        last = assembly.geometry.ngeoms - 1
        bodies.geometry.geometryObjects[last + 1].placement = placed.oMg[last]
        with pytest.raises(SettingError, match="free of contact between bodies"):
            tasks.check_bodies(bodies, np.deg2rad(ends[1]), "scenario.q_goal", "m")


def test_a_box_as_a_mesh_is_the_same_to_the_last_bit(
    shipped: dict[str, Condition], tmp_path: Path
) -> None:
    """Searches test the box around a mesh; the hull of a box is the box."""
    scene = yaml.safe_load((BOX / "scene0001.yaml").read_text())
    for each in scene["world"]["collision_objects"]:
        if any(body["type"] != "box" for body in each["primitives"]):
            continue
        each["meshes"] = [_as_mesh(box["dimensions"]) for box in each.pop("primitives")]
        each["mesh_poses"] = each.pop("primitive_poses")
    changed = tmp_path / "scene.yaml"
    changed.write_text(yaml.safe_dump(scene))
    files = f"scenario.scene={changed}", f"scenario.request='{BOX / 'request0001.yaml'}'"
    (meshes,) = conditions(*VIA_POINTS, *files).values()
    one, two = run_replicate(shipped["box_panda"], 0).summary, run_replicate(meshes, 0).summary
    assert (one.digest, one.certified) == (two.digest, two.certified)
    assert one.clearance == pytest.approx(two.clearance, abs=1e-6)
    planner, found = meshes.prepare()
    (note,) = (line for line in planner.notes(found) if "verdict judges their convex hu" in line)
    assert "side_left" in note


def _as_mesh(edges: list[float]) -> dict[str, object]:
    corners = 0.5 * np.array(edges) * list(itertools.product((-1.0, 1.0), repeat=3))
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    halves = [half for a, b, c, d in faces for half in ([a, b, c], [a, c, d])]
    return {
        "vertices": [dict(zip("xyz", corner, strict=True)) for corner in corners.tolist()],
        "triangles": [{"vertex_indices": half} for half in halves],
    }


def test_postures_reach_into_a_box_and_a_shelf() -> None:
    for label in ("box_panda", "bookshelf_thin_panda"):
        summary = run_replicate(composed(*POSTURES, label=label), 0).summary
        assert summary.solved and summary.certified


def test_covers_that_touch_at_the_start_are_left_to_the_certifier() -> None:
    """Those of a UR5's base and upper arm do where its problems begin, the bodies do not."""
    planner, problem = composed(*POSTURES, "budget=smoke", label="box_ur5").prepare()
    (note,) = (line for line in planner.notes(problem) if "left to the certifier" in line)
    assert note.startswith("covers touch at the start or the goal")
    assert "base_link with upper_arm_link" in note
    names = [problem.scene.pair_names(k) for k in range(len(problem.scene.pairs))]
    assert ("base_link", "upper_arm_link") in names  # which judges the pair all the same


def changed(folder: Path, change: Callable[[dict[str, Any]], None], *words: str) -> Condition:
    """Return a condition of the Panda before a box whose request's goal is changed."""
    asked = yaml.safe_load((BOX / "request0001.yaml").read_text())
    change(asked["goal_constraints"][0])
    (folder / "request.yaml").write_text(yaml.safe_dump(asked))
    files = f"scenario.scene='{BOX / 'scene0001.yaml'}'", f"scenario.request={folder}/request.yaml"
    (condition,) = conditions(*words, *files).values()
    return condition


def test_a_goal_in_contact_names_the_pair_and_how_deep(tmp_path: Path) -> None:
    def fold(goal: dict[str, Any]) -> None:
        for k, joint in enumerate(goal["joint_constraints"]):
            joint["position"] = -0.1 if k == 3 else 0.0

    said = r"panda_link5 and panda_rightfinger overlap by at most 0\.02\d+ m"
    with pytest.raises(SettingError, match=rf"scenario\.q_goal: .*{said}"):
        changed(tmp_path, fold, *VIA_POINTS).prepare()


def test_a_pose_out_of_reach_is_one_of_the_request(tmp_path: Path) -> None:
    def move_away(goal: dict[str, Any]) -> None:
        region: dict[str, Any] = {"primitives": [{"type": "sphere", "dimensions": [0.01]}]}
        region["primitive_poses"] = [{"position": [3, 0, 0]}]
        place = {"link_name": "panda_hand", "constraint_region": region}
        del goal["joint_constraints"]
        goal["position_constraints"] = [place]

    far = changed(tmp_path, move_away, "robot=panda", "scenario=moveit", *POSTURES[1:])
    with pytest.raises(SettingError, match=r"^scenario.request: must be within reach, 0\.98") as it:
        far.prepare()
    assert "check_reach" not in str(it.value)


def test_a_goal_for_a_joint_that_is_none_is_refused(tmp_path: Path) -> None:
    def misspell(goal: dict[str, Any]) -> None:
        goal["joint_constraints"][0]["joint_name"] = "panda_joint9"

    with pytest.raises(SettingError, match=r"joints that move .*'panda_joint9'.*did you mean"):
        changed(tmp_path, misspell, *VIA_POINTS).prepare()


def test_pairs_whose_covers_always_touch_are_named(shipped: dict[str, Condition]) -> None:
    planner, problem = shipped["box_ur5"].prepare()
    (line,) = (line for line in planner.notes(problem) if "in every sampled posture" in line)
    assert "tested by maps of exact distances" in line
    assert "forearm_link with wrist_2_link" in line
