"""A slow, plain reader of planning scenes, after MoveIt's own code and by Pinocchio alone.

It shares nothing with evoexp's reader. Followed are, in moveit_core: `Transforms::setTransform`,
`PlanningScene::getFrameTransform` and `PlanningScene::processCollisionObjectAdd`. Only an empty
`frame_id` is taken further than there, for the planning frame.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin


class PlacedShape(NamedTuple):
    """A shape of an object, where it stands in the world."""

    owner: str
    kind: str
    sizes: list[float]  # dimensions, coefficients
    corners: np.ndarray  # (corners, 3) of a mesh
    pose: Any  # pin.SE3


def numbers(value: Any, keys: str) -> list[float]:
    """Return a vector that is written as a mapping or as a list."""
    parts = [value.get(key, 0.0) for key in keys] if isinstance(value, dict) else value
    return [float(part) for part in parts]


def transform(value: Any, place: str = "position", turn: str = "orientation") -> Any:
    """Return a pose or transform as `pin.SE3`, its quaternion normalised as by Eigen."""
    value = value or {}
    position = np.array(numbers(value.get(place, [0, 0, 0]), "xyz"))
    x, y, z, w = numbers(value.get(turn, [0, 0, 0, 0]), "xyzw")
    if x == y == z == w == 0.0:
        return pin.SE3(np.eye(3), position)
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized().toRotationMatrix(), position)


class MoveitScene:
    """A planning scene of a robot, as MoveIt holds it."""

    def __init__(self, urdf: str, model_frame: str, root: Any) -> None:
        """Take a robot whose root has a pose in the planning frame."""
        model = pin.buildModelFromXML(urdf)
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        self.model_frame = model_frame
        self.links = {
            frame.name: root * data.oMf[k]
            for k, frame in enumerate(model.frames)
            if frame.type == pin.FrameType.BODY
        }
        self.transforms = {model_frame: pin.SE3.Identity()}

    def shapes(self, message: dict[str, Any]) -> list[PlacedShape]:
        """Return the shapes of all objects, in the planning frame."""
        for item in message.get("fixed_frame_transforms", []):
            if item["child_frame_id"].strip("/") == self.model_frame:
                name = item.get("header", {}).get("frame_id", "").strip("/")
                moved = transform(item.get("transform"), "translation", "rotation")
                self.transforms[name or self.model_frame] = moved
        return [
            shape for item in message["world"]["collision_objects"] for shape in self.object(item)
        ]

    def frame(self, name: str) -> Any:
        """Return the pose of a frame in the planning frame."""
        if name.startswith("/"):
            return self.frame(name[1:])
        if name in ("", self.model_frame):
            return pin.SE3.Identity()
        return self.links[name] if name in self.links else self.transforms[name]

    def object(self, item: dict[str, Any]) -> list[PlacedShape]:
        """Return the shapes of an object."""
        frame = self.frame(item.get("header", {}).get("frame_id", ""))
        origin, found, none = frame * transform(item.get("pose")), [], np.empty(0)

        def placed(kind: str, poses: str) -> Any:
            return zip(item.get(kind, []), item.get(poses, []), strict=True)

        for shape, pose in placed("primitives", "primitive_poses"):
            kind = {1: "box", 2: "sphere", 3: "cylinder", 4: "cone"}.get(shape["type"])
            kind, at = kind or str(shape["type"]).lower(), origin * transform(pose)
            found.append(PlacedShape(item["id"], kind, shape["dimensions"], none, at))
        for shape, pose in placed("planes", "plane_poses"):
            at = origin * transform(pose)
            found.append(PlacedShape(item["id"], "plane", shape["coef"], none, at))
        for shape, pose in placed("meshes", "mesh_poses"):
            corners, at = [numbers(c, "xyz") for c in shape["vertices"]], origin * transform(pose)
            found.append(PlacedShape(item["id"], "mesh", [], np.array(corners), at))
        return found
