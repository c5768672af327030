"""Files that a comparison takes: best known lengths, given runs."""

import hashlib
import math
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
import yaml
from pydantic import Field

import evoexp
from evoexp.errors import SettingError, demand, demand_known, nearest, printable
from evoexp.input_files import NUMBER, TableError, read_bounded, read_table
from evoexp.report.results.planner_runs import PlannerRuns, Problem
from evoexp.validation import NonNegativeCount, Positive, Settings, construct


class BestKnown(Settings):
    """The shortest proven answer known of a problem."""

    problem: str  # its name, for readers
    length: Positive  # of the joints' path [rad, m]
    run: Annotated[str, Field(pattern="^[0-9a-f]{12}$")]  # hash of the run that found it
    replicate: NonNegativeCount  # of that run


def shipped_best_known() -> dict[str, BestKnown]:
    """Return the shipped file's content by the keys of problems."""
    return read_best_known(Path(evoexp.__file__).parent / "assets/best_known.yaml")


def read_best_known(path: str | Path) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems.

    Raises:
        SettingError: If something in it cannot be.
        UnknownSetting: If an entry has another key.
        OSError: If it cannot be read.
    """
    return parsed(read_bounded(path), Path(path).name)


def parsed(content: bytes, name: str) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems."""
    try:
        entries = yaml.safe_load(content) or {}
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise SettingError(name, "YAML", str(error).splitlines()[0]) from None
    demand(isinstance(entries, dict), name, "a mapping of keys of problems", entries)
    for key, entry in entries.items():
        is_key = isinstance(key, str) and re.fullmatch("[0-9a-f]{12}", key)
        demand(is_key, name, "keys of 12 hex digits in quotation marks", key)
        must = f"a mapping of {', '.join(BestKnown.model_fields)}"
        demand(isinstance(entry, dict), f"{name}, {key}", must, entry)
    return {key: construct(BestKnown, entry, f"{name}, {key}") for key, entry in entries.items()}


COLUMNS = ("planner", "problem", "seed", "queries", "cost")
MARK = " (given)"  # behind the names of planners that were not run here
UNANSWERED = ("", "inf", "+inf", "infinity")  # costs of runs without an answer
MOST = 10**18  # seeds and queries stay below


class GivenData(NamedTuple):
    """A file's content."""

    name: str  # of the file
    sha256: str  # of its bytes, 64 hex digits
    # Its rows in order, columns `COLUMNS`: queries are the configurations that the run had judged
    # for collision so far, cost is the length of the path [rad, m]; NaN: no answer
    answers: pd.DataFrame


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
    columns = table[0].cells if table else []
    where = f"{name}, line {table[0].line}" if table else ""
    for column in columns:
        demand_known(column, COLUMNS, where, f"the columns {', '.join(COLUMNS)}")
    for column in COLUMNS if table else ():
        count = columns.count(column)
        demand(count == 1, f"{where}, {column}", "there once", f"{count} times")
    rows = [
        _answer(f"{name}, line {line}", dict(zip(columns, cells, strict=True)))
        for line, cells in table[1:]
    ]
    demand(rows, name, "a file with a row per improvement of a run", "no row")
    answers = pd.DataFrame(rows, columns=list(COLUMNS))
    return GivenData(name, hashlib.sha256(content).hexdigest(), answers)


def _answer(where: str, cells: dict[str, str]) -> tuple[str, str, int, int, float]:
    """Return the checked cells of a row in the order of `COLUMNS`."""
    for name in ("planner", "problem"):
        is_name = cells[name] and cells[name].isprintable()
        demand(is_name, f"{where}, {name}", "a name", cells[name])
    counts = {}
    for name in ("seed", "queries"):  # whole numbers, which may be written as `1e3` or `12.0`
        value = Decimal(cells[name]) if NUMBER.fullmatch(cells[name]) else Decimal(-1)
        is_count = 0 <= value < MOST and value == value.to_integral_value()
        must = "a whole number, at least 0, of 18 digits at most"
        demand(is_count, f"{where}, {name}", must, cells[name])
        counts[name] = int(value)
    cost = math.nan
    if cells["cost"].lower() not in UNANSWERED:
        cost = float(cells["cost"]) if NUMBER.fullmatch(cells["cost"]) else math.nan
        must = "a length above 0, or empty or inf where the run has no answer"
        demand(0.0 < cost < math.inf, f"{where}, cost", must, cells["cost"])
    return cells["planner"], cells["problem"], counts["seed"], counts["queries"], cost


def of_given(data: GivenData, ours: Sequence[PlannerRuns]) -> list[PlannerRuns]:
    """Return the runs of a file, beside ours; a run has spent the most queries of its rows.

    A problem is one of ours if the file calls it as the page does, or by a label of one of its
    conditions, or by its key; else it is a problem of its own, where any answer is the only target.
    """
    known = _known(ours)
    problems = [known.get(called, Problem(called)) for called in data.answers["problem"]]
    table = data.answers.assign(problem=[problem.name for problem in problems])
    by_name: dict[Any, Problem] = {problem.name: problem for problem in problems}
    named = len({*by_name, *(own.problem.name for own in ours)}) > 1
    given = []
    for (planner, name), rows in table.groupby(["planner", "problem"], sort=False):
        spent = rows.groupby("seed")["queries"].max()  # by the seeds, in their order
        answers = rows.dropna(subset="cost").sort_values(["seed", "queries"], kind="stable")
        columns = {"seed": "replicate", "queries": "collision_queries", "cost": "length"}
        proven = answers[list(columns)].rename(columns=columns).assign(certified=True)
        marked = f"{planner}{MARK}"
        own = PlannerRuns(
            marked,
            by_name[name],
            f"{name}: {marked}" if named else marked,
            proven.astype({"certified": bool}).reset_index(drop=True),
            tuple(map(int, spent.index)),
            spent.to_numpy(np.float64),
            None,
        )
        given.append(own)
    return given


def strange_problems(data: GivenData, ours: Sequence[PlannerRuns]) -> Iterator[str]:
    """Yield a line for each problem of a file that is none of ours, with the name perhaps meant."""
    known = _known(ours)
    for name in data.answers["problem"].unique():
        if name not in known:
            hint = nearest(name, known)
            yield f"{data.name}: '{name}' is a problem of its own, none of those compared{hint}"


def _known(ours: Sequence[PlannerRuns]) -> dict[str, Problem]:
    known = {own.problem.name: own.problem for own in ours}
    for own in ours:
        known.setdefault(own.label, own.problem)
        known.setdefault(own.problem.key, own.problem)
    return known
