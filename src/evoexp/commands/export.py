"""`evoexp export`: a motion as a joint trajectory, for a robot or MoveIt."""

import argparse
import math

from evoexp.commands.motion_files import (
    add_motion_arguments,
    output_path,
    single,
    speed_limits,
    write,
)
from evoexp.errors import SettingError
from evoexp.playback.trajectory import as_csv, as_json, trajectory


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_motion_arguments(parser, ".json")
    parser.add_argument(
        "--format", choices=("csv", "json"), default="json", help="json: as ROS's JointTrajectory"
    )
    parser.add_argument(
        "--timing",
        choices=("uniform", "optimal"),
        default="uniform",
        help="equal times from instant to instant, or as fast along the path as speeds and "
        "accelerations permit",
    )
    parser.add_argument(
        "--ramp",
        type=float,
        default=0.5,
        metavar="S",
        help="time from rest to full speed (optimal)",
    )


def main(arguments: argparse.Namespace) -> int:
    """Write the trajectory."""
    if not 0.0 < arguments.ramp < math.inf:
        raise SettingError("--ramp", "greater than 0", arguments.ramp)
    found = single(arguments)
    timed = trajectory(found, arguments.timing, speed_limits(arguments), arguments.ramp)
    content = as_csv(timed) if arguments.format == "csv" else as_json(found, timed)
    write(output_path(arguments, [found], f".{arguments.format}"), content)
    return 0
