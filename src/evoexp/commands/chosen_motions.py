"""Motions that commands judge, show and write: of stored replicates, of logs, or out of a file."""

import argparse
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.batch.reproduction import stored_condition
from evoexp.commands.arguments import is_motion, is_override
from evoexp.commands.motion_files import ENDINGS, flatten, read_motion, shape_of, shape_text
from evoexp.commands.stored_runs import finished_replicate, stored_run
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import MotionFileError, NothingStored, RevisionMismatch, SettingError, printable
from evoexp.paths.motion import Motion
from evoexp.playback.recording import Heading, Recording, joints_of, record, record_motion
from evoexp.playback.trajectory import SpeedLimits
from evoexp.playback.trajectory_files import JointTrajectory, fitted
from evoexp.records import FloatArray
from evoexp.robots.assembly import Robot
from evoexp.store.files import write_file
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_table

CHOICES = ("best", "worst", "refuted")  # among the replicates of a run
FOLDER = "motions"  # of the outputs
MANY = 4  # motions on one page
JUDGED = "a joint trajectory: judged by its bodies, not by where it begins and ends"


class FittingMotion(NamedTuple):
    """A motion file in a condition whose shape of solutions it has."""

    label: str  # of the condition
    condition: Condition
    solution: FloatArray  # flat; empty: the file holds a joint trajectory
    motion: Motion | None  # None: the solution has none
    remarks: tuple[str, ...] = ()  # on how a trajectory was read


# words of the command line


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


# motions in conditions


def fitting_motions(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> tuple[Path, list[FittingMotion]]:
    """Return the motion file among words, and the conditions of the others whose shape it has."""
    files = [word for word in words if is_motion(word) or Path(word).exists()]
    overrides = [word for word in words if word not in files]
    if len(files) != 1:
        found = " ".join(files) or "none"
        raise MotionFileError(f"motion file: one is needed ({ENDINGS}), got {len(files)}: {found}")
    path = Path(files[0])
    values = read_motion(path)
    fitting, misfits = [], dict[str, None]()
    for experiment in compose.expand(overrides, multirun=multirun, only=only):
        for label, condition in experiment.conditions:
            try:
                fitting.append(_fitting(label, condition, values))
            except ValueError as misfit:
                misfits[str(misfit)] = None
    if not fitting and isinstance(values, JointTrajectory):
        raise MotionFileError(f"{path}: {'; '.join(misfits)}")
    if not fitting:
        plain = all("numbers" in text for text in misfits)
        included = "" if plain else " (start and goal included)"
        raise MotionFileError(
            f"{path}: must be {'; '.join(misfits)}{included}, was {shape_of(values)}"
        )
    return path, fitting


def stored_motion(log: Path) -> FittingMotion:
    """Return the best solution of a log, in the condition that is attached to it."""
    contents = read_log(log)
    label = f"{contents.condition_id[:12]} #{contents.replicate}"
    return _solved(label, stored_condition(log, contents), contents.solutions[-1].values)


def initial_motion(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> FittingMotion:
    """Return the best of an initial population, in the first of conditions of one shape."""
    experiments = compose.expand(words, multirun=multirun, only=only)
    conditions = [each for experiment in experiments for each in experiment.conditions]
    prepared = [each.condition.prepare() for each in conditions]
    shapes = dict.fromkeys(shape_text(planner.shape(problem)) for planner, problem in prepared)
    if len(shapes) > 1:
        raise MotionFileError(
            f"--write: solutions differ in shape ({'; '.join(shapes)}); choose with --only "
            + " | ".join(repr(each.label) for each in conditions)
        )
    (label, condition), (planner, problem) = conditions[0], prepared[0]
    first = next(planner.evolve(problem, condition.rng(0)))
    return _solved(label, condition, first.best)


def _solved(label: str, condition: Condition, solution: FloatArray) -> FittingMotion:
    planner, problem = condition.prepare()
    return FittingMotion(label, condition, solution, planner.motion(problem, solution))


def _fitting(label: str, condition: Condition, values: Any) -> FittingMotion:
    """Return the content of a motion file in a condition; ValueError: it does not fit."""
    planner, problem = condition.prepare()
    if not isinstance(values, JointTrajectory):
        shape = planner.shape(problem)
        if (solution := flatten(values, shape)) is None:
            raise ValueError(f"{label}: {shape_text(shape)}")
        return _solved(label, condition, solution)
    if not isinstance(condition.robot, Robot):
        raise ValueError(f"{label}: its robot has no joints for a trajectory")
    joints = joints_of(condition.robot.build())
    motion, remarks = fitted(values, joints, condition.length_unit)
    if len(planner.parts(problem, motion)) > 1:
        raise ValueError(
            f"{label}: bodies are picked up or put down on the way, which a trajectory does not "
            "tell; give the solution (evaluate HASH --write FILE.json)"
        )
    return FittingMotion(label, condition, np.empty(0), motion, (JUDGED, *remarks))
