"""`evoexp export`: a motion as a joint trajectory, for a robot or MoveIt."""

import argparse
import math

import numpy as np

from evoexp.commands.chosen_motions import (
    output_path,
    single,
    speed_limits,
    write,
)
from evoexp.commands.console import say
from evoexp.errors import SettingError
from evoexp.playback.trajectory import as_csv, as_json, as_ros, joint_limits, trajectory

ANSWERS = {True: "yes", False: "no", None: "undecided"}


def main(arguments: argparse.Namespace) -> int:
    """Write the trajectory."""
    if not 0.0 < arguments.ramp < math.inf:
        raise SettingError("--ramp", "greater than 0", arguments.ramp)
    found = single(arguments)
    prismatic = np.array([joint.prismatic for joint in found.joints])
    speeds = speed_limits(arguments).of(prismatic, found.size)
    names = tuple(joint.name for joint in found.joints)
    limits = joint_limits(names, arguments.limits, speeds, found.velocity_limits, arguments.ramp)
    timed = trajectory(found, arguments.timing, limits)
    if arguments.format == "ros":
        content = as_ros(timed)
    else:
        content = as_csv(timed) if arguments.format == "csv" else as_json(found, timed)
    ending = ".csv" if arguments.format == "csv" else ".json"
    write(output_path(arguments, [found], ending), content)
    # how long the motion takes, how near it comes to the limits, and what is proven of it
    speed, acceleration = (
        float((rate / limit).max()) for rate, limit in zip(timed.rates(), limits, strict=True)
    )
    if timed.interpolation == "linear":
        rates = f"at most {speed:.0%} of a joint's speed, which jumps at every point"
    else:
        rates = f"at most {speed:.0%} of a joint's speed, {acceleration:.0%} of its acceleration"
    verdict = timed.verdict
    say(
        f"{timed.times[-1]:.2f} s, {len(timed.times)} points; {rates}; certified: "
        f"{ANSWERS[verdict.certified]}, margin kept: {ANSWERS[verdict.certified_margin]}"
    )
    return 0
