"""`evoexp view`, `play` and `export`: motions of stored replicates, of logs, or out of a file."""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from evoexp.batch.reproduction import stored_condition
from evoexp.commands.command_parser import is_motion, is_override
from evoexp.commands.motion_files import fitting_motions
from evoexp.commands.stored_runs import finished_replicate, stored_run
from evoexp.errors import MotionFileError, NothingStored, RevisionMismatch, SettingError, printable
from evoexp.playback.player_page import page
from evoexp.playback.recording import Heading, Recording, record, record_motion
from evoexp.playback.trajectory import SpeedLimits
from evoexp.store.files import write_file
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_table

CHOICES = ("best", "worst", "refuted")  # among the replicates of a run
FOLDER = "motions"  # of the outputs
MANY = 4  # motions on one page
ANSWERS = {True: "yes", False: "no", None: "undecided"}


def named_log(word: str, choice: str | int | None) -> tuple[Path, RunDirectory | None]:
    """Return the log that a word names: its path, or the choice among the run of a hash."""
    path = Path(word)
    if path.suffix == ".mcap" or path.is_file():
        return path, None
    run = stored_run(word)
    return chosen_log(run, CHOICES[0] if choice is None else choice), run


def chosen_log(run: RunDirectory, choice: str | int) -> Path:
    """Return the log of one replicate of a run, chosen by its index or by one of `CHOICES`."""
    if isinstance(choice, int):
        return run.log_path(finished_replicate(run, choice))
    table = summary_table(run, thorough=True).to_pylist()
    done = [row for row in table if row["status"] == "done"]
    if choice == "refuted":
        rows = [row for row in done if row["certified"] is False]
    else:
        sign = 1.0 if choice == "best" else -1.0  # those of no finite cost come last
        finite = [row for row in done if math.isfinite(row["best_cost"])]
        rows = sorted(finite, key=lambda row: sign * row["best_cost"]) or done
    if not rows:
        what = "refuted replicate" if choice == "refuted" else "finished replicate"
        raise NothingStored(f"run {run.hash12}: no {what} among {len(done)}")
    return run.log_path(rows[0]["replicate"])


def recordings(arguments: argparse.Namespace) -> list[Recording]:
    """Return the motions that the arguments choose, in the order of the words."""
    limits, words = speed_limits(arguments), arguments.what
    if any(is_override(word) or is_motion(word) for word in words):
        only = (arguments.only,) if arguments.only else ()
        path, fitting = fitting_motions(words, only=only)  # of those that it fits, the first ones
        for remark in fitting[0].remarks[1:]:
            print(f"{path.name}: {remark}")
        return [
            record_motion(own.condition, own.motion, Heading(f"{path.name} · {own.label}"), limits)
            for own in fitting[:MANY]
        ]
    if len(words) > MANY:
        raise MotionFileError(f"motions: at most {MANY} go together, got {len(words)}")
    choice = arguments.replicate if arguments.replicate is not None else arguments.choice
    return [_stored_recording(*named_log(word, choice), limits) for word in words]


def single(arguments: argparse.Namespace) -> Recording:
    """Return the single motion that the arguments choose."""
    found = recordings(arguments)
    if len(found) != 1:
        raise MotionFileError(f"motion: one at a time, got {len(found)}; choose with --only LABEL")
    return found[0]


def speed_limits(arguments: argparse.Namespace) -> SpeedLimits:
    """Return the joints' limits."""
    for name in ("turn_speed", "slide_speed"):
        value = getattr(arguments, name)
        if value is not None and not 0.0 < value < math.inf:
            raise SettingError(f"--{name.replace('_', '-')}", "greater than 0", value)
    return SpeedLimits(math.radians(arguments.turn_speed), arguments.slide_speed)


def _stored_recording(log: Path, run: RunDirectory | None, limits: SpeedLimits) -> Recording:
    """Return the motion of a log's best solution; the log alone is enough."""
    contents, title = read_log(log), log.name
    if run is not None:
        origin = run.origin()
        names = [str(origin[name]) for name in ("experiment", "label") if origin.get(name)]
        title = " · ".join(dict.fromkeys(names)) or run.hash12
    try:
        condition = stored_condition(log, contents)
    except RevisionMismatch as error:
        if run is None:
            raise
        raise RevisionMismatch(
            f"run {run.hash12}: {error}; run it anew with what is installed: {run.command}"
        ) from None
    improvements = tuple((row.generation, row.cost) for row in contents.solutions)
    heading = Heading(title, contents.replicate, improvements)
    recording = record(condition, contents.solutions[-1].values, heading, limits)
    return recording._replace(condition_id=contents.condition_id, config_json=contents.config_json)


def output_path(arguments: argparse.Namespace, motions: Iterable[Recording], ending: str) -> Path:
    """Return the path of the file to write, which may take its name from the motions."""
    if arguments.output is not None:
        return Path(arguments.output)
    names = [Path(word).stem for word in arguments.what if is_motion(word)]
    names = names or [f"{m.condition_id[:12]}-{m.heading.replicate:04d}" for m in motions]
    return outputs_root() / FOLDER / ("+".join(names) + ending)


def write(path: Path, content: bytes, *, is_said: bool = True) -> None:
    """Write a file whole or not at all, and say where it is and how large."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content)
    if is_said:
        size = len(content) / 1000
        text = f"{size / 1000:.2f} MB" if size >= 1000 else f"{size:.0f} kB"
        print(f"{printable(str(path))}  ({text})")


# commands that write motions


def view(arguments: argparse.Namespace) -> int:
    """Write motions as one offline page that plays them."""
    motions = recordings(arguments)
    write(output_path(arguments, motions, ".html"), page(motions))
    return 0


def play(arguments: argparse.Namespace) -> int:
    """Write a motion as a log that plays in Foxglove, and the layout file beside it."""
    from evoexp.playback.playable_log import LAYOUT, layout, playable_log  # and Foxglove's types

    motion = single(arguments)
    path = output_path(arguments, [motion], ".mcap")
    write(path, playable_log(motion))
    write(path.with_name(LAYOUT), layout())
    return 0


def export(arguments: argparse.Namespace) -> int:
    """Write a motion as a joint trajectory, for a robot or MoveIt."""
    from evoexp.commands.console import say
    from evoexp.playback import trajectory  # and scipy

    if not 0.0 < arguments.ramp < math.inf:
        raise SettingError("--ramp", "greater than 0", arguments.ramp)
    found = single(arguments)
    prismatic = np.array([joint.prismatic for joint in found.joints])
    speeds = speed_limits(arguments).of(prismatic, found.size)
    names = tuple(joint.name for joint in found.joints)
    limits = trajectory.joint_limits(
        names, arguments.limits, speeds, found.velocity_limits, arguments.ramp
    )
    timed = trajectory.trajectory(found, arguments.timing, limits)
    if arguments.format == "ros":
        content = trajectory.as_ros(timed)
    else:
        content = (
            trajectory.as_csv(timed)
            if arguments.format == "csv"
            else trajectory.as_json(found, timed)
        )
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
