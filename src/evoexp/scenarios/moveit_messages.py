"""The fields of MoveIt's messages: which are read, left out, noted or refused.

The names are those of moveit_msgs in ROS 1 (Noetic) and ROS 2 (Rolling), and those that robowflex
writes. A field that no message has is refused: whatever it says would be lost.
"""

from typing import Any

from evoexp.errors import SettingError, nearest
from evoexp.input_files import MEGABYTE

MAX_SCENE = 4 * MEGABYTE  # the largest of the data set MotionBenchMaker has 12 kB
SCENE, REQUEST = "PlanningScene", "MotionPlanRequest"
READ = "read"
LEFT_OUT = "left out"  # it changes neither the bodies nor the goal
NOTED = "noted"  # `show` and the report say that it is left out


def _fields(read: str = "", left_out: str = "", noted: str = "", **parts: str) -> dict[str, str]:
    """Return fields and their uses: the message in each of `parts`, names that blanks divide."""
    uses = ((READ, read), (LEFT_OUT, left_out), (NOTED, noted))
    return {name: use for use, names in uses for name in names.split()} | parts


# message → field → the message in it, or what is done with its value
FIELDS: dict[str, dict[str, str]] = {
    SCENE: _fields(
        left_out="name object_colors",
        noted="robot_model_name is_diff",
        robot_state="RobotState",
        fixed_frame_transforms="TransformStamped",
        allowed_collision_matrix="AllowedCollisionMatrix",
        link_padding="LinkPadding",
        link_scale="LinkScale",
        world="PlanningSceneWorld",
    ),
    "PlanningSceneWorld": _fields(collision_objects="CollisionObject", octomap="OctomapWithPose"),
    "OctomapWithPose": _fields(left_out="header origin", octomap="Octomap"),
    "Octomap": _fields(left_out="header binary id resolution", data="refused: octomaps"),
    "CollisionObject": _fields(
        read="id operation",
        left_out="type subframe_names subframe_poses",
        header="Header",
        pose="Pose",
        primitives="SolidPrimitive",
        primitive_poses="Pose",
        meshes="Mesh",
        mesh_poses="Pose",
        planes="Plane",
        plane_poses="Pose",
    ),
    "SolidPrimitive": _fields("type dimensions", left_out="polygon"),  # prisms are refused
    "Mesh": _fields("triangles vertices resource dimensions"),
    "Plane": _fields("coef"),
    "AllowedCollisionMatrix": _fields(
        "entry_names default_entry_names default_entry_values", entry_values="AllowedCollisionEntry"
    ),
    "AllowedCollisionEntry": _fields("enabled"),
    "LinkPadding": _fields("link_name padding"),
    "LinkScale": _fields("link_name scale"),
    "RobotState": _fields(
        left_out="is_diff",  # the request's values come before the scene's, as in MoveIt
        joint_state="JointState",
        multi_dof_joint_state="MultiDOFJointState",
        attached_collision_objects="refused: attached objects",
    ),
    "JointState": _fields("name position", left_out="header velocity effort"),
    "MultiDOFJointState": _fields(
        "joint_names", left_out="twist wrench", header="Header", transforms="Transform"
    ),
    # left out: the workspace bounds planar and floating joints, where MoveIt's optimisers begin;
    # cartesian_speed_end_effector_link is the name in ROS 1
    REQUEST: _fields(
        "group_name",
        left_out="workspace_parameters reference_trajectories pipeline_id planner_id "
        "num_planning_attempts allowed_planning_time cartesian_speed_limited_link "
        "cartesian_speed_end_effector_link",
        noted="max_velocity_scaling_factor max_acceleration_scaling_factor max_cartesian_speed",
        start_state="RobotState",
        goal_constraints="Constraints",
        path_constraints="refused: path constraints",
        trajectory_constraints="refused: trajectory constraints",
    ),
    "Constraints": _fields(
        left_out="name",
        joint_constraints="JointConstraint",
        position_constraints="PositionConstraint",
        orientation_constraints="OrientationConstraint",
        visibility_constraints="refused: visibility constraints",
    ),
    # the middle is planned to
    "JointConstraint": _fields(
        "joint_name position", left_out="tolerance_above tolerance_below weight"
    ),
    "PositionConstraint": _fields(
        "link_name",
        left_out="weight",
        header="Header",
        target_point_offset="Vector3",
        constraint_region="BoundingVolume",
    ),
    "BoundingVolume": _fields(
        left_out="mesh_poses",
        primitives="SolidPrimitive",
        primitive_poses="Pose",
        meshes="refused: goals within meshes",
    ),
    # the least tolerance bounds the angle of either parameterization
    "OrientationConstraint": _fields(
        "link_name absolute_x_axis_tolerance absolute_y_axis_tolerance absolute_z_axis_tolerance",
        left_out="parameterization weight",
        header="Header",
        orientation="Quaternion",
    ),
    "Header": _fields("frame_id", left_out="stamp seq"),
    "TransformStamped": _fields("child_frame_id", header="Header", transform="Transform"),
    "Transform": _fields(translation="Vector3", rotation="Quaternion"),
    "Pose": _fields(position="Point", orientation="Quaternion"),
    "Point": _fields("x y z"),
    "Vector3": _fields("x y z"),
    "Quaternion": _fields("x y z w"),
}


def check_fields(value: Any, message: str, field: str, where: str = "") -> None:
    """Refuse fields that a message, or a list of such, does not have, or evoexp does not know."""
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
    """Refuse a file that holds another message, or one that stands below another key."""
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
