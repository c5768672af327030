"""`evoexp view`, `play`, `export`, `evaluate`: motions of replicates, of logs, or out of a file."""

import argparse
import functools
import json
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Column, Table

from evoexp.batch.reproduction import stored_condition
from evoexp.collision.certifier.certificate import PAIR
from evoexp.commands import motion_files
from evoexp.commands.command_parser import is_motion, is_override
from evoexp.commands.console import new_table, plain_console, print_json, right, say
from evoexp.commands.motion_files import FittingMotion, fitting_motions, nested, stored_motion
from evoexp.commands.stored_runs import finished_replicate, stored_run
from evoexp.errors import MotionFileError, NothingStored, RevisionMismatch, demand, printable
from evoexp.planners.answers import Listing, judge_motion
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
    motions = recordings(arguments)
    if len(motions) != 1:
        raise MotionFileError(
            f"motion: one at a time, got {len(motions)}; choose with --only LABEL"
        )
    return motions[0]


def speed_limits(arguments: argparse.Namespace) -> SpeedLimits:
    """Return the joints' limits."""
    for name in ("turn_speed", "slide_speed"):
        value = getattr(arguments, name)
        is_speed = value is None or 0.0 < value < math.inf
        demand(is_speed, f"--{name.replace('_', '-')}", "greater than 0", value)
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
    from evoexp.playback import trajectory  # and scipy

    demand(0.0 < arguments.ramp < math.inf, "--ramp", "greater than 0", arguments.ramp)
    motion = single(arguments)
    prismatic = np.array([joint.prismatic for joint in motion.joints])
    speeds = speed_limits(arguments).of(prismatic, motion.size)
    names = tuple(joint.name for joint in motion.joints)
    limits = trajectory.joint_limits(
        names, arguments.limits, speeds, motion.velocity_limits, arguments.ramp
    )
    timed = trajectory.trajectory(motion, arguments.timing, limits)
    write_json = functools.partial(trajectory.as_json, motion)
    writers: Any = {"ros": trajectory.as_ros, "csv": trajectory.as_csv, "json": write_json}
    content = writers[arguments.format](timed)
    ending = ".csv" if arguments.format == "csv" else ".json"
    write(output_path(arguments, [motion], ending), content)
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


DEPARTURES = "departures"  # of a row: the ways in which the motion is none of the task
REMARKS = "remarks"  # of a row: how a trajectory was read
HEX = re.compile("[0-9a-fA-F]{1,64}")  # a prefix of a hash
_Judged = tuple[dict[str, Any], Listing | None]  # a row, and its table of configurations
HEAD = ("label", "condition", "length_unit")  # of a row; its other entries are terms and verdict


def evaluate(arguments: argparse.Namespace) -> int:
    """Print terms and exact verdict of the motion; conditions that say the same share a column."""
    fitting = _motions(arguments)
    if arguments.write is not None:
        if not fitting[0].solution.size:
            raise MotionFileError("--write: must go with a solution, was given with a trajectory")
        planner, problem = fitting[0].condition.prepare()
        lists = nested(fitting[0].solution, planner.shape(problem))
        write(arguments.write, json.dumps(lists).encode(), is_said=not arguments.json)
    judged: list[_Judged] = []
    for label, condition, solution, motion, remarks in fitting:
        planner, problem = condition.prepare()
        head = dict(zip(HEAD, (label, condition.id, condition.length_unit), strict=True))
        verdict = judge_motion(planner, problem, motion)._asdict()
        if remarks:  # of a trajectory a planner knows neither terms nor departures
            judged.append((head | verdict | {DEPARTURES: [], REMARKS: list(remarks)}, None))
            continue
        terms = planner.evaluate(problem, solution)
        departures = list(planner.departures(problem, solution))
        of_task = {"solution_of_the_task": not departures}
        row = head | terms | of_task | verdict | {DEPARTURES: departures}
        judged.append((row, planner.listing(problem, solution)))
    rows = [row for row, _ in judged]
    if arguments.json:
        for row, listing in judged:
            if listing is not None:
                names, cells = listing
                row["rows"] = [dict(zip(names, values, strict=True)) for values in cells]
        print_json(rows if len(rows) > 1 else rows[0])
        return 0
    # conditions of one group say the same of the motion
    alike: dict[str, list[_Judged]] = {}
    for row, listing in judged:
        said = {name: value for name, value in row.items() if name not in HEAD[:2]}
        alike.setdefault(repr((said, listing)), []).append((row, listing))
    groups = list(alike.values())
    for group in groups:
        if (listing := group[0][1]) is not None:  # a row per configuration of the motion
            texts = (map(_cell, cells) for cells in listing.rows)
            say(new_table(_labels(group), *right(*listing.names), rows=texts))
    for table in _tables([[row for row, _ in group] for group in groups], plain_console().width):
        say(table)
    for group in groups:
        for departure in group[0][0][DEPARTURES]:
            say(f"{_labels(group)} – no solution of the task: {departure}")
    for remark in dict.fromkeys(remark for row in rows for remark in row.get(REMARKS, ())):
        say(remark)
    return 0


def _labels(group: Sequence[_Judged]) -> str:
    return ", ".join(row["label"] for row, _ in group)


def _motions(arguments: argparse.Namespace) -> Sequence[FittingMotion]:
    words: list[str] = arguments.overrides
    if arguments.write is not None and arguments.write.suffix != ".json":
        raise MotionFileError(f"--write: must be a file that ends in .json, was {arguments.write}")
    hashes = [word for word in words if HEX.fullmatch(word) and not Path(word).exists()]
    if all(word.endswith(".mcap") or word in hashes for word in words):
        return [stored_motion(named_log(word, arguments.replicate)[0]) for word in words]
    if arguments.replicate is not None:
        raise MotionFileError("--replicate: must go with a hash, was given with an experiment")
    asked: Any = {"multirun": arguments.multirun, "only": arguments.only}
    if arguments.write is not None and not any(is_motion(word) for word in words):
        return [motion_files.initial_motion(words, **asked)]
    return fitting_motions(words, **asked)[1]


def _tables(columns: list[list[dict[str, Any]]], width: int) -> list[Table]:
    """Return a table with one column per group of conditions; more in a narrow terminal."""
    apart, rows = (*HEAD, DEPARTURES, REMARKS), [row for group in columns for row in group]
    names = list(dict.fromkeys(name for row in rows for name in row if name not in apart))
    longest_word = max(len(word) for row in rows for word in row["label"].split())
    column = min(max(12, longest_word), 40) + 3
    count = max(1, (width - max(map(len, names)) - 4) // column)
    tables = []
    for k in range(0, len(columns), count):
        shown = columns[k : k + count]
        heads = [[f"{row['label']}\n{row['condition'][:12]}" for row in group] for group in shown]
        cells = ((name, *(_cell(group[0].get(name)) for group in shown)) for name in names)
        first, others = Column(no_wrap=True), right(*map("\n".join, heads))
        tables.append(new_table("", first, *others, rows=cells))
    return tables


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or value == "":
        return "–"
    return value.replace(PAIR, PAIR + "\n") if isinstance(value, str) else f"{value:.6g}"
