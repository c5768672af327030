"""The motions that a command shows or writes: of stored replicates, of logs, or out of a file."""

import argparse
import math

from evoexp.commands.motion_words import MANY, ChosenLog, check_speeds, chosen_logs
from evoexp.errors import MotionFileError, RevisionMismatch
from evoexp.playback.recording import Heading, Recording, record_motion
from evoexp.playback.stored import stored_recording
from evoexp.playback.timing import SpeedLimits


def recordings(arguments: argparse.Namespace) -> list[Recording]:
    """Return the motions that the arguments choose, in the order of the words.

    Raises:
        EvoexpError: One line says what is wrong.
    """
    limits = speed_limits(arguments)
    if logs := chosen_logs(arguments):
        return [_stored(log, limits) for log in logs]
    return _own(arguments.what, arguments.only, limits)


def single(arguments: argparse.Namespace) -> Recording:
    """Return the single motion that the arguments choose.

    Raises:
        MotionFileError: If it is not one.
    """
    found = recordings(arguments)
    if len(found) != 1:
        raise MotionFileError(f"motion: one at a time, got {len(found)}; choose with --only LABEL")
    return found[0]


def file_name(recording: Recording) -> str:
    """Return the name of a file with a motion, without its ending."""
    return f"{recording.condition_id[:12]}-{recording.heading.replicate:04d}"


def speed_limits(arguments: argparse.Namespace) -> SpeedLimits:
    """Return the joints' limits.

    Raises:
        SettingError: If one is not above 0.
    """
    check_speeds(arguments)
    return SpeedLimits(math.radians(arguments.turn_speed), arguments.slide_speed)


def _stored(log: ChosenLog, limits: SpeedLimits) -> Recording:
    try:
        return stored_recording(log.path, log.title, limits)
    except RevisionMismatch as error:
        if log.run is None:
            raise
        raise RevisionMismatch(
            f"run {log.run.hash12}: {error}; run it anew with what is installed: {log.run.command}"
        ) from None


def _own(words: list[str], only: str, limits: SpeedLimits) -> list[Recording]:
    """Return the motion of a file in every condition that it fits, in the first `MANY` of them."""
    from evoexp.commands.given_motion import fitting_motions  # Hydra's words, of no stored run

    path, fitting = fitting_motions(words, only=(only,) if only else ())
    for remark in fitting[0].remarks[1:]:
        print(f"{path.name}: {remark}")
    return [
        record_motion(each.condition, each.motion, Heading(f"{path.name} · {each.label}"), limits)
        for each in fitting[:MANY]
    ]
