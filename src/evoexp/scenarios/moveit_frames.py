"""The frames in which a planning scene and a request give places.

MoveIt names a frame of its own in `header.frame_id` of a fixed transform and the planning frame in
`child_frame_id`; the transform takes coordinates in the named frame to the planning frame
(`Transforms::setTransform` and `copyTransforms` in moveit_core's `transforms.cpp`). A frame that is
a link comes before a transform (`PlanningScene::getFrameTransform`).
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evoexp.errors import nearest
from evoexp.scenarios.moveit_files import IDENTITY, MessagePart, Pose

if TYPE_CHECKING:
    from evoexp.robots.assembly import LinkFrames

WORLD = "world"  # the planning frame where nothing else names it
SAME = 1e-6  # [m, -] by which two descriptions of one frame may differ: they are rounded


class Frames(NamedTuple):
    """Frames by their names, without a slash before them."""

    planning: str  # the planning frame
    poses: dict[str, Pose]  # frames that stand still → their poses in the world
    moving: frozenset[str]  # links that move

    def of_header(self, part: MessagePart) -> Pose:
        """Return the pose of the frame that the header of a part names, or the planning frame's."""
        name = frame_name(part["header"]["frame_id"])
        must = f"given in a frame that stands still ({', '.join(self.poses)}) at {part.where}"
        if name in self.moving:
            raise part.refusal(must, f"'{name}', a link that moves")
        if (name := name or self.planning) not in self.poses:
            raise part.refusal(must, name, nearest(name, self.poses))
        return self.poses[name]


def frame_name(part: MessagePart) -> str:
    """Return the name of a frame; `/base` and `base` are one."""
    return part.text.strip().lstrip("/")


def read_frames(scene: MessagePart, links: "LinkFrames | None") -> Frames:
    """Read the fixed transforms of a scene beside the links of a robot, if these have names."""
    root, standing, moving, ground = links or ("", (), frozenset[str](), "")
    named, planning, is_certain = _fixed_transforms(scene)
    known = dict.fromkeys(filter(None, (ground, root, WORLD)))
    if planning in moving or (planning and not is_certain and planning not in known):
        must = f"of transforms whose child_frame_id is the planning frame ({', '.join(known)})"
        hint = "; header.frame_id names the frame that a transform places"
        raise scene.refusal(must, planning, hint)
    planning = planning or ground or WORLD
    poses = {}
    for name, numbers in standing:  # the rotation row by row, then the position
        poses[name] = Pose(np.array(numbers[:9]).reshape(3, 3), np.array(numbers[9:]))
    origin = poses.setdefault(planning, IDENTITY)
    if ground:
        poses.setdefault(ground, IDENTITY)
    for name in (name for name in named if name not in moving):
        pose = origin.times(named[name])
        if not pose.is_near(poses.setdefault(name, pose), SAME):
            must = f"a scene whose transform of '{name}' is that of the robot's link"
            raise scene.refusal(must, pose.text, f"; the link stands {poses[name].text}")
    return Frames(planning, poses, moving)


def has_other_frames(scene: MessagePart) -> bool:
    """Whether a scene has fixed transforms of frames other than the planning frame."""
    poses = _fixed_transforms(scene)[0].values()
    return not all(pose.is_near(IDENTITY, SAME) for pose in poses)


def _fixed_transforms(scene: MessagePart) -> tuple[dict[str, Pose], str, bool]:
    """Return the transforms, in the planning frame; its name, if given; whether it is sure."""
    # it is sure where MoveIt wrote it: with a transform into itself
    named: dict[str, Pose] = {}
    planning, is_certain = "", False
    transforms = scene["fixed_frame_transforms"]
    for transform in transforms:
        name = frame_name(transform["header"]["frame_id"])
        target, pose = frame_name(transform["child_frame_id"]), transform["transform"].pose
        is_identity = pose.is_near(IDENTITY, SAME)
        where = f"{transform.where}.header.frame_id"
        must = f"a frame other than '{target}' at {where}, or no transform"
        scene.require(is_identity or name not in ("", target), must, name)
        must = f"the planning frame at {transform.where}.child_frame_id"
        scene.require(target or not name, must, "")
        must = f"one planning frame for all of {transforms.where}, the child_frame_id '{planning}'"
        is_same = not planning or target in ("", planning)
        scene.require(is_same, must, f"'{name}' in '{target}'")
        planning = target or planning
        is_certain |= bool(target) and name in ("", target)
        if name and not pose.is_near(named.setdefault(name, pose), SAME):
            must = f"one transform of '{name}' in {transforms.where}"
            raise scene.refusal(must, f"{named[name].text} and {pose.text}")
    return named, planning, is_certain
