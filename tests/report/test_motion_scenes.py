"""Pictures of any motion: what is drawn has the sizes and places of the bodies."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from evoexp.playback.shapes import Outline
from evoexp.report.figures import motion_scenes, motion_tables, surfaces
from evoexp.report.figures.style import drawn
from matrix import matrices_are_asked_for
from playback_samples import SAMPLES, condition, matrix, recording


def volume(triangles: np.ndarray) -> float:
    a, b, c = triangles.transpose(1, 0, 2)
    return float((np.cross(a, b) * c).sum() / 6.0)  # positive: each is seen from outside


@pytest.mark.parametrize(
    ("kind", "size", "truth"),
    [
        ("box", (1.0, 2.0, 3.0), 6.0),
        ("sphere", (0.5, 0.0, 0.0), 4.0 / 3.0 * np.pi * 0.5**3),
        ("ellipsoid", (1.0, 2.0, 0.5), 4.0 / 3.0 * np.pi),
        ("capsule", (0.5, 2.0, 0.0), np.pi * 0.25 * 2.0 + 4.0 / 3.0 * np.pi * 0.5**3),
        ("cylinder", (0.5, 2.0, 0.0), np.pi * 0.25 * 2.0),
        ("cone", (0.5, 2.0, 0.0), np.pi * 0.25 * 2.0 / 3.0),
    ],
)
def test_surfaces_have_the_volume_of_their_bodies(
    kind: str, size: tuple[float, ...], truth: float
) -> None:
    found = surfaces.triangles_of(kind, np.array(size), None)
    assert volume(found) == pytest.approx(
        truth, rel=0.09
    )  # 14 pieces around: 3 % less at most each
    assert volume(found) <= truth * (1.0 + 1e-12)


def test_a_large_mesh_is_drawn_by_corners_of_its_hull() -> None:
    points = np.random.Generator(np.random.PCG64(1)).normal(size=(5000, 3))
    found = surfaces.corners_of(Outline("mesh", (), points, np.zeros((0, 3), np.int64)))
    assert found is not None and len(found) <= surfaces.MOST_CORNERS
    triangles = surfaces.triangles_of("mesh", np.zeros(3), found)
    assert 0.9 * ConvexHull(points).volume < volume(triangles) <= ConvexHull(points).volume + 1e-9


def test_poses_place_as_matrices_do() -> None:
    rng = np.random.Generator(np.random.PCG64(2))
    triangles, pose = rng.normal(size=(7, 3, 3)), rng.normal(size=7)
    pose[3:] /= np.sqrt((pose[3:] ** 2).sum())
    m = matrix(pose)
    truth = triangles @ m[:3, :3].T + m[:3, 3]
    assert np.allclose(surfaces.placed(triangles, pose), truth, atol=1e-12)


DRAWN = ("grid", "three arms", "postures")  # in a plane, in a row, in space; others with --all


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_every_motion_has_its_pictures(name: str) -> None:
    shown = recording(name)
    scenes = motion_tables.scenes_table([(name, shown)])
    robot = [shape for shape in shown.shapes if shape.role == "arm"]
    assert (scenes["element"] == "start").sum() == len(robot)
    assert (scenes["element"] == "obstacle").sum() == sum(
        shape.role == "obstacle" for shape in shown.shapes
    )
    way = scenes[(scenes["element"] == "way") & (scenes["arm"] == 0)][["x", "y", "z"]]
    assert np.allclose(way.to_numpy(), shown.traces[0], atol=1e-6)
    joints = motion_tables.joints_table(shown)
    first = joints[joints["joint"] == shown.joints[0].name]["value"].to_numpy()
    scale = 1.0 if shown.joints[0].prismatic else 180.0 / np.pi
    assert np.allclose(first, scale * shown.q[:, 0], atol=1e-6)
    planner, problem = condition(name).prepare()
    covers = planner.covers(problem)
    pictures = [
        lambda: motion_scenes.draw_scenes(scenes),
        lambda: motion_scenes.draw_stages(motion_tables.stages_table(shown)),
        lambda: motion_scenes.draw_joints(joints),
    ]
    if covers:
        table = motion_tables.covers_table([(name, shown, covers)])
        assert (table["element"] == "cover").sum() == len(covers)
        pictures.append(lambda: motion_scenes.draw_covers(table))
    for axes in pictures[0]().axes:  # the whole way is within the picture
        for name_of_axis, limits in (("x", axes.get_xlim()), ("y", axes.get_ylim())):
            assert limits[0] < way[name_of_axis].min() <= way[name_of_axis].max() < limits[1]
    for picture in pictures if name in DRAWN or matrices_are_asked_for() else ():
        assert len(drawn(picture, ("png",), 40)["png"]) > 2000


@pytest.mark.parametrize("name", ["postures", "two arms in space", "two arms"])
def test_covers_hold_the_bodies_that_they_stand_for(name: str) -> None:
    """Each link's middle lies in a cover, unless it stands still or has no body of its own."""
    shown, own = recording(name), condition(name)
    planner, problem = own.prepare()
    table = motion_tables.covers_table([(name, shown, planner.covers(problem))])
    covers, bodies = (table[table["element"] == element] for element in ("cover", "body"))
    solid = [covers[covers["kind"] == kind] for kind in ("sphere", "capsule")]
    assert sum(map(len, solid)) == len(covers)
    moving = [shape.name for shape in shown.shapes if shape.role == "arm" and shape.frame >= 0]
    for body in bodies[bodies["name"].isin(moving)].itertuples():
        middle = np.array([body.x, body.y, body.z])
        inside = False
        for cover in covers.itertuples():
            at = np.array([cover.x, cover.y, cover.z])
            turn = matrix(np.array([*at, cover.qx, cover.qy, cover.qz, cover.qw]))[:3, :3]
            half = 0.5 * cover.size_2 if cover.kind == "capsule" else 0.0
            along = turn[:, 2] * np.clip((middle - at) @ turn[:, 2], -half, half)
            inside |= np.linalg.norm(middle - at - along) <= cover.size_1 * 1.5
        assert inside, body.name
