"""Runs of other people's planners, read from a CSV file: one row per improvement of a run.

Nobody here judges them: their answers count as given, and are marked so wherever they stand.
"""

import hashlib
import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from evoexp.errors import SettingError, nearest, printable
from evoexp.input_files import NUMBER, TableError, read_bounded, read_table
from evoexp.report.results.planner_runs import PlannerRuns, Problem

COLUMNS = ("planner", "problem", "seed", "queries", "cost")
MARK = " (given)"  # behind the names of planners that were not run here
UNANSWERED = ("inf", "+inf", "infinity")  # costs of runs without an answer, as well as none
MOST = 10**18  # seeds and queries stay below


class GivenAnswer(NamedTuple):
    """A row of the file."""

    line: int  # number of the line in the file, from 1
    planner: str  # its name
    problem: str  # name of the problem
    seed: int  # of the run
    queries: int  # configurations that the run had judged for collision so far
    cost: float  # length of the path [rad, m]; NaN: no answer, the whole run has spent that much


class GivenData(NamedTuple):
    """A file's content."""

    name: str  # of the file
    sha256: str  # of its bytes, 64 hex digits
    answers: tuple[GivenAnswer, ...]  # its rows, in order


def read_given(path: str) -> GivenData:
    """Read a file with the columns planner, problem, seed, queries and cost.

    Raises:
        SettingError: If something in it cannot be; names line and column.
        OSError: If it cannot be read.
    """
    content = read_bounded(path)
    name = printable(Path(path).name)
    try:
        table = read_table(content)
    except TableError as error:
        raise SettingError(f"{name}, line {error.line}", error.must, error.was) from None
    columns = _header(f"{name}, line {table[0].line}", table[0].cells) if table else []
    answers = tuple(
        _row(f"{name}, line {line}", line, dict(zip(columns, cells, strict=True)))
        for line, cells in table[1:]
    )
    if not answers:
        raise SettingError(name, "a file with a row per improvement of a run", "no row")
    _check_runs(name, answers)
    return GivenData(name, hashlib.sha256(content).hexdigest(), answers)


def _header(where: str, names: list[str]) -> list[str]:
    """Return the names of the columns in the file's order."""
    for column in names:
        if column not in COLUMNS:
            must = f"the columns {', '.join(COLUMNS)}"
            raise SettingError(where, must, column, nearest(column, COLUMNS))
    for column in COLUMNS:
        if names.count(column) != 1:
            raise SettingError(f"{where}, {column}", "there once", f"{names.count(column)} times")
    return names


def _row(where: str, line: int, cells: dict[str, str]) -> GivenAnswer:
    for name in ("planner", "problem"):
        if not cells[name] or not cells[name].isprintable():
            raise SettingError(f"{where}, {name}", "a name", cells[name])
    seed, queries = (_whole(f"{where}, {name}", cells[name]) for name in ("seed", "queries"))
    cost = math.nan
    if cells["cost"] and cells["cost"].lower() not in UNANSWERED:
        cost = float(cells["cost"]) if NUMBER.fullmatch(cells["cost"]) else math.nan
        if not 0.0 < cost < math.inf:
            must = "a length above 0, or empty or inf where the run has no answer"
            raise SettingError(f"{where}, cost", must, cells["cost"])
    return GivenAnswer(line, cells["planner"], cells["problem"], seed, queries, cost)


def _whole(where: str, text: str) -> int:
    """Return a whole number, which may be written as `1e3` or `12.0`."""
    value = Decimal(text) if NUMBER.fullmatch(text) else Decimal(-1)
    if not 0 <= value < MOST or value != value.to_integral_value():
        raise SettingError(where, "a whole number, at least 0, of 18 digits at most", text)
    return int(value)


def _by_run(answers: Sequence[GivenAnswer]) -> dict[tuple[str, str, int], list[GivenAnswer]]:
    found: dict[tuple[str, str, int], list[GivenAnswer]] = {}
    for row in answers:
        found.setdefault((row.planner, row.problem, row.seed), []).append(row)
    return found


def _check_runs(name: str, answers: Sequence[GivenAnswer]) -> None:
    """Refuse rows of one run that contradict each other."""
    for run in _by_run(answers).values():
        at: dict[int, int] = {}  # queries → line
        ends = [row for row in run if math.isnan(row.cost)]
        for row in run:
            where = f"{name}, line {row.line}"
            if math.isnan(row.cost):
                if row is not ends[0]:
                    must = f"a length: line {ends[0].line} is this run's row without one"
                    raise SettingError(f"{where}, cost", must, "")
                continue
            if row.queries in at:
                must = f"another number than in line {at[row.queries]}, of the same run"
                raise SettingError(f"{where}, queries", must, row.queries)
            at[row.queries] = row.line
        if ends and at and ends[0].queries < max(at):
            must = f"at least {max(at)}, as the same run spent in line {at[max(at)]}"
            raise SettingError(f"{name}, line {ends[0].line}, queries", must, ends[0].queries)


def of_given(data: GivenData, ours: Sequence[PlannerRuns]) -> list[PlannerRuns]:
    """Return the runs of a file, beside ours.

    A problem is one of ours if the file calls it as the page does, or by a label of one of its
    conditions, or by its key; else it is a problem of its own, where any answer is the only target.
    """
    known = _known(ours)
    cells: dict[tuple[str, str], dict[int, list[GivenAnswer]]] = {}
    for (planner, called, seed), rows in _by_run(data.answers).items():
        problem = known.get(called, Problem(called))
        known.setdefault(problem.name, problem)
        cells.setdefault((planner, problem.name), {}).setdefault(seed, []).extend(rows)
    named = len({*(own.problem.name for own in ours), *(name for _, name in cells)}) > 1
    given = []
    for (planner, name), runs in cells.items():
        seeds = tuple(sorted(runs))  # the runs of a planner on a problem, in their order
        proven = [
            (seed, row.queries, row.cost, True)
            for seed in seeds
            for row in sorted(runs[seed], key=lambda each: each.queries)
            if not math.isnan(row.cost)
        ]
        columns = ["replicate", "collision_queries", "length", "certified"]
        marked, spent = planner + MARK, [max(row.queries for row in runs[seed]) for seed in seeds]
        own = PlannerRuns(
            marked,
            known[name],
            f"{name}: {marked}" if named else marked,
            pd.DataFrame(proven, columns=columns).astype({"certified": bool}),
            seeds,
            np.array(spent, dtype=np.float64),
            None,
        )
        given.append(own)
    return given


def strange_problems(data: GivenData, ours: Sequence[PlannerRuns]) -> Iterator[str]:
    """Yield a line for each problem of a file that is none of ours, with the name perhaps meant."""
    known = _known(ours)
    for name in dict.fromkeys(row.problem for row in data.answers):
        if name not in known:
            hint = nearest(name, known)
            yield f"{data.name}: '{name}' is a problem of its own, none of those compared{hint}"


def _known(ours: Sequence[PlannerRuns]) -> dict[str, Problem]:
    """Return our problems by each name that a file may call them."""
    known: dict[str, Problem] = {own.problem.name: own.problem for own in ours}
    for own in ours:
        known.setdefault(own.label, own.problem)
        known.setdefault(own.problem.key, own.problem)
    return known
