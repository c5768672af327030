"""Planar chains and several arms in one model."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.errors import SettingError
from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain
from evoexp.validation import build


def test_tip_of_a_planar_chain_by_hand() -> None:
    chain = PlanarChain(link_lengths=(4.0, 3.0), base_position=(1.0, 2.0), base_angle=90.0)
    assembly = chain.build()
    data = assembly.model.createData()
    pin.forwardKinematics(assembly.model, data, np.array([0.0, np.pi / 2]))
    tip = data.oMi[2].act(assembly.links[1].end)
    assert tip == pytest.approx([1.0 - 3.0, 2.0 + 4.0, 0.0], abs=1e-12)


def test_arms_are_slices_of_one_configuration() -> None:
    robot = Arms(
        arms=(
            PlanarChain(link_lengths=(1.0, 1.0, 1.0), base_position=(0.0, 0.0)),
            PlanarChain(link_lengths=(2.0,), base_position=(5.0, 0.0)),
        )
    )
    assembly = robot.build()
    assert assembly.arm_slices.tolist() == [[0, 3], [3, 4]]
    assert assembly.model.nq == 4
    assert [link.arm for link in assembly.links] == [0, 0, 0, 1]
    assert assembly.table.planar


def test_geometry_holds_the_links_as_capsules_of_the_given_radius() -> None:
    assembly = PlanarChain(
        link_lengths=(2.0, 1.0), base_position=(0.0, 0.0), link_radius=0.1
    ).build()
    shapes = [geometry.geometry for geometry in assembly.geometry.geometryObjects]
    assert all(isinstance(shape, coal.Capsule) for shape in shapes)
    assert [2.0 * shape.halfLength for shape in shapes] == [2.0, 1.0]
    assert [shape.radius for shape in shapes] == [0.1, 0.1]
    data, geometry_data = assembly.model.createData(), assembly.geometry.createData()
    pin.updateGeometryPlacements(
        assembly.model, data, assembly.geometry, geometry_data, np.array([0.3, 0.4])
    )
    for link, placement, shape in zip(assembly.links, geometry_data.oMg, shapes, strict=True):
        world = data.oMi[link.joint]
        assert placement.act(np.array([0.0, 0.0, shape.halfLength])) == pytest.approx(
            world.act(link.end)
        )
        assert placement.act(np.array([0.0, 0.0, -shape.halfLength])) == pytest.approx(
            world.act(link.start)
        )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"link_lengths": [], "base_position": [0, 0]},
            "robot.link_lengths: must be a list of at least 1",
        ),
        (
            {"link_lengths": [1, 0], "base_position": [0, 0]},
            r"robot.link_lengths\[1\]: must be greater than 0",
        ),
        ({"link_lengths": [1], "base_position": [0]}, r"robot.base_position"),
        ({"link_lengths": [1]}, "robot.base_position: must be given"),
    ],
)
def test_impossible_chains_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        build({"_target_": "planar_chain", **settings}, lambda name, field: PlanarChain, "robot")


def test_a_tool_is_a_ball_that_moves_with_the_tip() -> None:
    assembly = PlanarChain(
        link_lengths=(2.0, 1.0), base_position=(0.0, 0.0), tool_radius=0.3
    ).build()
    *links, tool = assembly.links
    assert [link.is_tool for link in links] == [False, False]
    assert tool.is_tool
    assert isinstance(assembly.geometry.geometryObjects[2].geometry, coal.Sphere)
    data, placements = assembly.model.createData(), assembly.geometry.createData()
    q = np.array([0.4, -1.1])
    pin.updateGeometryPlacements(assembly.model, data, assembly.geometry, placements, q)
    tip = [2.0 * np.cos(0.4) + np.cos(-0.7), 2.0 * np.sin(0.4) + np.sin(-0.7), 0.0]
    assert placements.oMg[2].translation == pytest.approx(tip, abs=1e-12)


def test_circles_of_one_size_cannot_show_a_tool() -> None:
    assembly = PlanarChain(
        link_lengths=(2.0, 1.0), base_position=(0.0, 0.0), tool_radius=0.3
    ).build()
    with pytest.raises(SettingError, match="robot: must be without tools"):
        TouchingSpheres(spheres_per_link=5, sphere_radius=0.1, collision_substeps=1).bind(
            assembly, ()
        )
