"""The fields of MoveIt's messages: which are read, left out, noted or refused.

The names are those of moveit_msgs in ROS 1 (Noetic) and ROS 2 (Rolling), and those that robowflex
writes. A field that no message has is refused: whatever it says would be lost.
"""

from typing import Any

from evoexp.errors import SettingError, nearest

SCENE, REQUEST = "PlanningScene", "MotionPlanRequest"
READ = "read"
LEFT_OUT = "left out"  # it changes neither the bodies nor the goal
NOTED = "noted"  # `show` and the report say that it is left out
_XYZ = dict.fromkeys("xyz", READ)
_HEADER = {"frame_id": READ, "stamp": LEFT_OUT, "seq": LEFT_OUT}

# message → field → the message in it, or what is done with its value
FIELDS: dict[str, dict[str, str]] = {
    SCENE: {
        "name": LEFT_OUT,
        "robot_state": "RobotState",
        "robot_model_name": NOTED,
        "fixed_frame_transforms": "TransformStamped",
        "allowed_collision_matrix": "AllowedCollisionMatrix",
        "link_padding": "LinkPadding",
        "link_scale": "LinkScale",
        "object_colors": LEFT_OUT,
        "world": "PlanningSceneWorld",
        "is_diff": NOTED,
    },
    "PlanningSceneWorld": {"collision_objects": "CollisionObject", "octomap": "OctomapWithPose"},
    "OctomapWithPose": {"header": LEFT_OUT, "origin": LEFT_OUT, "octomap": "Octomap"},
    "Octomap": dict.fromkeys(("header", "binary", "id", "resolution"), LEFT_OUT)
    | {"data": "refused: octomaps"},
    "CollisionObject": {
        "header": "Header",
        "pose": "Pose",
        "id": READ,
        "type": LEFT_OUT,
        "primitives": "SolidPrimitive",
        "primitive_poses": "Pose",
        "meshes": "Mesh",
        "mesh_poses": "Pose",
        "planes": "Plane",
        "plane_poses": "Pose",
        "subframe_names": LEFT_OUT,
        "subframe_poses": LEFT_OUT,
        "operation": READ,
    },
    "SolidPrimitive": {"type": READ, "dimensions": READ, "polygon": LEFT_OUT},  # prisms are refused
    "Mesh": dict.fromkeys(("triangles", "vertices", "resource", "dimensions"), READ),
    "Plane": {"coef": READ},
    "AllowedCollisionMatrix": {
        "entry_names": READ,
        "entry_values": "AllowedCollisionEntry",
        "default_entry_names": READ,
        "default_entry_values": READ,
    },
    "AllowedCollisionEntry": {"enabled": READ},
    "LinkPadding": {"link_name": READ, "padding": READ},
    "LinkScale": {"link_name": READ, "scale": READ},
    "RobotState": {
        "joint_state": "JointState",
        "multi_dof_joint_state": "MultiDOFJointState",
        "attached_collision_objects": "refused: attached objects",
        "is_diff": LEFT_OUT,  # the request's values come before the scene's, as in MoveIt
    },
    "JointState": {
        "header": LEFT_OUT,
        "name": READ,
        "position": READ,
        "velocity": LEFT_OUT,
        "effort": LEFT_OUT,
    },
    "MultiDOFJointState": {
        "header": "Header",
        "joint_names": READ,
        "transforms": "Transform",
        "twist": LEFT_OUT,
        "wrench": LEFT_OUT,
    },
    REQUEST: {
        "start_state": "RobotState",
        "goal_constraints": "Constraints",
        "path_constraints": "refused: path constraints",
        "trajectory_constraints": "refused: trajectory constraints",
        "group_name": READ,
        "workspace_parameters": LEFT_OUT,  # bounds of planar and floating joints
        "reference_trajectories": LEFT_OUT,  # where MoveIt's optimisers begin
        "pipeline_id": LEFT_OUT,
        "planner_id": LEFT_OUT,
        "num_planning_attempts": LEFT_OUT,
        "allowed_planning_time": LEFT_OUT,
        "max_velocity_scaling_factor": NOTED,
        "max_acceleration_scaling_factor": NOTED,
        "max_cartesian_speed": NOTED,
        "cartesian_speed_limited_link": LEFT_OUT,
        "cartesian_speed_end_effector_link": LEFT_OUT,  # its name in ROS 1
    },
    "Constraints": {
        "name": LEFT_OUT,
        "joint_constraints": "JointConstraint",
        "position_constraints": "PositionConstraint",
        "orientation_constraints": "OrientationConstraint",
        "visibility_constraints": "refused: visibility constraints",
    },
    "JointConstraint": {
        "joint_name": READ,
        "position": READ,
        "tolerance_above": LEFT_OUT,  # the middle is planned to
        "tolerance_below": LEFT_OUT,
        "weight": LEFT_OUT,
    },
    "PositionConstraint": {
        "header": "Header",
        "link_name": READ,
        "target_point_offset": "Vector3",
        "constraint_region": "BoundingVolume",
        "weight": LEFT_OUT,
    },
    "BoundingVolume": {
        "primitives": "SolidPrimitive",
        "primitive_poses": "Pose",
        "meshes": "refused: goals within meshes",
        "mesh_poses": LEFT_OUT,
    },
    "OrientationConstraint": {
        "header": "Header",
        "link_name": READ,
        "orientation": "Quaternion",
        "absolute_x_axis_tolerance": READ,
        "absolute_y_axis_tolerance": READ,
        "absolute_z_axis_tolerance": READ,
        "parameterization": LEFT_OUT,  # the least tolerance bounds the angle of either
        "weight": LEFT_OUT,
    },
    "Header": _HEADER,
    "TransformStamped": {"header": "Header", "child_frame_id": READ, "transform": "Transform"},
    "Transform": {"translation": "Vector3", "rotation": "Quaternion"},
    "Pose": {"position": "Point", "orientation": "Quaternion"},
    "Point": _XYZ,
    "Vector3": _XYZ,
    "Quaternion": dict.fromkeys("xyzw", READ),
}


def check_fields(value: Any, message: str, field: str, where: str = "") -> None:
    """Refuse fields that a message does not have, and those that evoexp does not know.

    Args:
        value: The message, or a list of such messages.
        message: Its type.
        field: The setting that names the file, for errors.
        where: The value's place in the file.

    Raises:
        SettingError: Naming the field and its place.
    """
    if isinstance(value, list):
        for k, item in enumerate(value):
            check_fields(item, message, field, f"{where}[{k}]")
    if not isinstance(value, dict):
        return
    for key, part in value.items():
        place = f"{where}.{key}" if where else str(key)
        use = FIELDS[message].get(str(key), "")
        if not use:
            must = f"made of the fields of {message} ({', '.join(FIELDS[message])})"
            raise SettingError(field, must, place, nearest(str(key), FIELDS[message]))
        if use.startswith("refused: ") and _holds(part):
            must = f"free of {use.removeprefix('refused: ')}, which evoexp does not know"
            raise SettingError(field, must, place)
        if use in FIELDS:
            check_fields(part, use, field, place)


def check_message(root: dict[str, Any], message: str, field: str) -> None:
    """Refuse a file that holds another message, or one that stands below another key.

    Raises:
        SettingError: Naming the message or the key.
    """
    own = FIELDS[message].keys()
    if root and not own & root.keys():
        must = f"a {message} of moveit_msgs by itself"
        for key, part in root.items():
            if isinstance(part, dict) and own & part.keys():
                hint = f"; write the part below '{key}' into a file of its own"
                raise SettingError(field, must, f"one below '{key}'", hint)
        for other in (SCENE, REQUEST):
            if FIELDS[other].keys() & root.keys():
                raise SettingError(field, must, f"a {other}")
    check_fields(root, message, field)


def _holds(value: Any) -> bool:
    """Whether a part says anything: an empty message has only empty parts, and perhaps a name."""
    if isinstance(value, dict):
        return any(_holds(part) for key, part in value.items() if key not in ("header", "name"))
    return bool(value)
