"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import tempfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from evoexp.attachments import SHA256, File, keep
from evoexp.errors import SettingError, nearest
from evoexp.robots.assembly import Chain, Link, Tool
from evoexp.robots.bodies import Point3, placed
from evoexp.robots.mesh_files import MESHES, mesh_content
from evoexp.robots.urdf_text import LARGEST, MESH, check_urdf, file_content, parsed_xml, plain_urdf
from evoexp.validation import Settings


class Mesh(Settings):
    """A mesh of a collision body.

    Attributes:
        name: As the URDF names it.
        file: Its content.
    """

    name: str
    file: File


class Urdf(Chain):
    """An arm out of a URDF; in a configuration `path` (and `srdf`) name the files that are read.

    Attributes:
        urdf: The URDF.
        meshes: Of its collision bodies.
        srdf: Names pairs of links that are never judged; None: none are named.
        base_frame: The link, fixed to the ground, whose frame stands at the base; empty: the root.
        base_position: Where the base stands in the world [m].
        base_rotation: Its roll, pitch, yaw [deg].
        tool_frame: The link or joint whose frame is the tool's; empty: the link farthest down the
            tree.
    """

    component: ClassVar[str] = "urdf"

    urdf: File
    meshes: tuple[Mesh, ...] = ()
    srdf: File | None = None
    base_frame: str = ""
    base_position: Point3 = (0.0, 0.0, 0.0)
    base_rotation: Point3 = (0.0, 0.0, 0.0)
    tool_frame: str = ""

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths.

        Raises:
            SettingError: If a file is missing or is no URDF, or a joint is of another kind than
                evoexp's kinematics.
        """
        settings = dict(settings)
        if "path" not in settings:
            return settings
        path, srdf = settings.pop("path"), settings.pop("srdf", None)
        content = file_content(path, f"{field}.path")
        root = parsed_xml(content, f"{field}.path", "robot")
        check_urdf(root, f"{field}.path")
        settings["urdf"] = {SHA256: keep(content)}
        names = dict.fromkeys(str(mesh.get("filename")) for mesh in root.iterfind(MESH))
        if names:
            found = {name: mesh_content(name, Path(path), f"{field}.path") for name in names}
            settings["meshes"] = [
                {"name": name, "file": {SHA256: keep(data)}} for name, data in found.items()
            ]
        if srdf is not None:
            content = file_content(srdf, f"{field}.srdf")
            parsed_xml(content, f"{field}.srdf", "robot")
            settings["srdf"] = {SHA256: keep(content)}
        return settings

    def append_to(self, model: Any, arm: int) -> list[Link]:
        """Add the joints; a link is the line from a joint to one behind it.

        The last to the tool.
        """
        own, first = self._model(), model.njoints
        base = self._base(own)
        for joint in range(1, own.njoints):
            parent, placement = own.parents[joint], own.jointPlacements[joint]
            before = (0, base * placement) if parent == 0 else (first + parent - 1, placement)
            added = model.addJoint(
                before[0], own.joints[joint], before[1], f"arm_{arm}_{own.names[joint]}"
            )
            index = own.idx_qs[joint]
            model.lowerPositionLimit[model.idx_qs[added]] = own.lowerPositionLimit[index]
            model.upperPositionLimit[model.idx_qs[added]] = own.upperPositionLimit[index]
        links = []
        for joint in range(1, own.njoints):
            parent, end = own.parents[joint], own.jointPlacements[joint].translation
            if parent == 0:
                links.append(
                    Link(
                        arm,
                        0,
                        np.array(base.translation),
                        np.array((base * own.jointPlacements[joint]).translation),
                        0.0,
                    )
                )
            else:
                links.append(Link(arm, first + parent - 1, np.zeros(3), np.array(end), 0.0))
        tool = self.tool(model, first, links)
        links.append(Link(arm, tool.joint, np.zeros(3), tool.position, 0.0))
        return [link for link in links if not np.array_equal(link.start, link.end)]

    def append_bodies(self, model: Any, arm: int, first_joint: int, links: list[Link]) -> list[Any]:
        """Return the collision bodies."""
        own = self._model()
        base = self._base(own)
        items = list(self._geometry(own).geometryObjects)
        stems = [item.name.rpartition("_")[0] for item in items]
        bodies = []
        for item, stem in zip(items, stems, strict=True):
            name = stem if stems.count(stem) == 1 else item.name
            joint = item.parentJoint
            where = (
                (first_joint + joint - 1, item.placement) if joint else (0, base * item.placement)
            )
            bodies.append(pin.GeometryObject(name, where[0], 0, where[1], item.geometry))
        if not bodies:
            raise SettingError("robot.path", "a URDF with collision bodies", None)
        return bodies

    def tool(self, model: Any, first_joint: int, links: list[Link]) -> Tool:
        """Return the tool's frame."""
        own = self._model()
        frames = [
            frame
            for frame in own.frames
            if frame.type in (pin.FrameType.BODY, pin.FrameType.FIXED_JOINT)
        ]
        name = self.tool_frame or max(frames, key=lambda frame: frame_depth(own, frame)).name
        frame = frame_named(own, name, "tool_frame")
        if frame.parentJoint == 0:
            raise SettingError("robot.tool_frame", "a frame that moves", name)
        placement = frame.placement
        joint = first_joint + frame.parentJoint - 1
        return Tool(joint, np.array(placement.rotation), np.array(placement.translation))

    def disabled_pairs(self) -> set[frozenset[str]]:
        """Return pairs of bodies that the SRDF switches off."""
        if self.srdf is None:
            return set()
        root = parsed_xml(self.srdf.content, "robot.srdf", "robot")
        names = [item.name for item in self._geometry(self._model()).geometryObjects]
        stems = [name.rpartition("_")[0] for name in names]
        of_link: dict[str, set[str]] = {}
        for name, stem in zip(names, stems, strict=True):
            of_link.setdefault(stem, set()).add(stem if stems.count(stem) == 1 else name)
        pairs = [
            (str(pair.get("link1")), str(pair.get("link2")))
            for pair in root.iterfind("disable_collisions")
        ]
        return {
            frozenset((a, b))
            for one, two in pairs
            for a in of_link.get(one, ())
            for b in of_link.get(two, ())
        }

    def _model(self) -> Any:
        try:
            return pin.buildModelFromXML(plain_urdf(self.urdf.content, {}))
        except (ValueError, RuntimeError) as error:
            raise SettingError(
                "robot.path", "a URDF that Pinocchio reads", str(error).strip().splitlines()[0]
            ) from None

    def _geometry(self, model: Any) -> Any:
        with tempfile.TemporaryDirectory() as directory:
            places = {}
            for k, mesh in enumerate(self.meshes):
                ending = Path(mesh.name).suffix.lower()
                if ending not in MESHES:
                    must = f"a name that ends in {', '.join(MESHES)}"
                    raise SettingError(f"robot.meshes[{k}].name", must, mesh.name)
                place = Path(directory) / f"mesh_{k}{ending}"
                place.write_bytes(mesh.file.content)
                places[mesh.name] = str(place)
            try:
                text = plain_urdf(self.urdf.content, places)
                found = pin.buildGeomFromUrdfString(
                    model, text, pin.GeometryType.COLLISION, None, directory
                )
            except (ValueError, RuntimeError) as error:
                raise SettingError(
                    "robot.path",
                    "a URDF whose collision bodies can be read",
                    str(error).strip().splitlines()[0].replace(directory, ""),
                ) from None

        for item in found.geometryObjects:
            item.geometry.computeLocalAABB()
            far = np.abs(item.placement.translation).max() + item.geometry.aabb_radius
            if not 0.0 <= far <= LARGEST:
                must = f"a URDF whose bodies lie within {LARGEST:g} m"
                raise SettingError("robot.path", must, f"'{item.name}' that reaches to {far:.3g}")
        return found

    def _base(self, model: Any) -> Any:
        """Return the `pin.SE3` of the root in the world."""
        base = placed(self.base_position, self.base_rotation)
        if not self.base_frame:
            return base
        frame = frame_named(model, self.base_frame, "base_frame")
        if frame.parentJoint != 0:
            raise SettingError("robot.base_frame", "a frame that does not move", self.base_frame)
        return base * frame.placement.inverse()


def frame_named(model: Any, name: str, field: str) -> Any:
    """Find a `pin.Frame` of a model by its name.

    Raises:
        SettingError: If there is none; the names of all are listed.
    """
    names = [frame.name for frame in model.frames]
    if name not in names:
        raise SettingError(
            f"robot.{field}",
            f"a frame of the URDF ({', '.join(names)})",
            name,
            nearest(name, names),
        )
    return model.frames[names.index(name)]


def frame_depth(model: Any, frame: Any) -> tuple[int, int]:
    """Return how many joints carry a frame, and how many frames."""
    joint, count = frame.parentJoint, 0
    while joint > 0:
        joint, count = model.parents[joint], count + 1
    steps, index = 0, frame.parentFrame
    while index > 0:
        index, steps = model.frames[index].parentFrame, steps + 1
    return count, steps
