"""Runs in the format of IOHprofiler, for IOHanalyzer and iohinspector.

A folder per planner holds, as IOHexperimenter writes them, `IOHprofiler_f1_<problem>.json` for each
problem, and beside it the rows of its runs, `data_f1_<problem>/IOHprofiler_f1_DIM7.dat`: a header
above each run, then a row for its first evaluation, for each improvement and for its end. An
evaluation is a collision query, `raw_y` the length of the shortest proven answer so far. Readers
cannot compute with infinite values, so `NO_ANSWER` stands for the length before the first answer,
plus the number of the run in its file: iohinspector leaves out rows that repeat the value before
them, also where that is another run's, and with them runs without an answer.
"""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from evoexp.report.results.planner_runs import PlannerRuns

VERSION = "0.3.18"  # of IOHexperimenter, whose files these are like
SUITE = "evoexp"
INSTANCE = 1  # seeds are repetitions on one instance of a problem
NO_ANSWER = 1e6  # [rad, m] longer than any path; ten times as much where a given one is not
HEADER = ("evaluations", "raw_y")
Rows = list[tuple[int, float]]


def ioh_files(runs: Sequence[PlannerRuns]) -> dict[str, bytes]:
    """Return the contents of all files by their paths in the folder.

    Args:
        runs: Of each planner on each problem; the problems are numbered from 1 in their order.
    """
    problems = list(dict.fromkeys(own.problem.name for own in runs))
    folders = _slugs(dict.fromkeys(own.planner for own in runs))
    names, nothing = _slugs(problems), no_answer(runs)
    dimensions = {
        name: _dimension(own for own in runs if own.problem.name == name) for name in problems
    }
    cells: dict[tuple[str, str], list[PlannerRuns]] = {}
    for own in runs:
        cells.setdefault((own.planner, own.problem.name), []).append(own)
    files: dict[str, bytes] = {}
    for (planner, problem), same in cells.items():
        number, size = problems.index(problem) + 1, dimensions[problem]
        data = f"data_f{number}_{names[problem]}/IOHprofiler_f{number}_DIM{size}.dat"
        content = {
            "version": VERSION,
            "suite": SUITE,
            "function_id": number,
            "function_name": problem,
            "maximization": False,
            "algorithm": {"name": planner, "info": "evoexp"},
            "run_attributes": ["seed"],
            "attributes": list(HEADER),
            "scenarios": [{"dimension": size, "path": data, "runs": _summaries(same, nothing)}],
        }
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        folder = folders[planner]
        files[f"{folder}/IOHprofiler_f{number}_{names[problem]}.json"] = text.encode()
        files[f"{folder}/{data}"] = _data(same, nothing).encode()
    return files


def no_answer(runs: Sequence[PlannerRuns]) -> float:
    """Return the length that stands for no answer: a power of ten above all lengths."""
    longest = max((float(own.table["length"].max()) for own in runs if len(own.table)), default=0.0)
    value = NO_ANSWER
    while value <= longest:
        value *= 10.0
    return value


def run_rows(own: PlannerRuns, replicate: int, spent: float, nothing: float) -> Rows:
    """Return (evaluations, length of the shortest proven answer so far) of a run.

    Readers tell runs apart by the first evaluation, so its row is always there, and is the only one
    of that number.
    """
    table = own.table[(own.table["replicate"] == replicate) & own.table["certified"]]
    rows, best = [(1, nothing)], nothing
    for queries, length in sorted(zip(table["collision_queries"], table["length"], strict=True)):
        if length >= best:
            continue
        best, at = float(length), max(int(queries), 1)
        if rows[-1][0] == at:
            rows.pop()
        rows.append((at, best))
    if spent > rows[-1][0]:
        rows.append((int(spent), best))
    return rows


def _every_run(same: Sequence[PlannerRuns], nothing: float) -> Iterator[tuple[int, Rows]]:
    """Yield seed and rows of every run."""
    number = 0
    for own in same:
        for replicate, spent in zip(own.replicates, own.spent, strict=True):
            yield replicate, run_rows(own, replicate, float(spent), nothing + number)
            number += 1


def _summaries(same: Sequence[PlannerRuns], nothing: float) -> list[dict[str, Any]]:
    found = []
    for seed, rows in _every_run(same, nothing):
        y = rows[-1][1]
        first = next(evaluations for evaluations, value in rows if value == y)
        best = {"evals": first, "y": y, "x": []}
        evals = rows[-1][0]
        found.append({"instance": INSTANCE, "evals": evals, "best": best, "seed": seed})
    return found


def _data(same: Sequence[PlannerRuns], nothing: float) -> str:
    lines = []
    for _, rows in _every_run(same, nothing):
        lines.append(" ".join(HEADER))
        lines += [f"{evaluations} {value!r}" for evaluations, value in rows]
    return "\n".join([*lines, ""])


def _dimension(runs: Iterable[PlannerRuns]) -> int:
    """Return the number of joints that a problem's motions have; 0 where nobody here knows it."""
    for own in runs:
        if own.condition is None:
            continue
        planner, problem = own.condition.prepared
        for solution in own.condition.solutions.values():
            motion = planner.motion(problem, solution)
            if motion is not None:
                return int(motion.q.shape[1])
    return 0


def _slugs(names: Iterable[str]) -> dict[str, str]:
    """Return a name for files of each name, all different, also where case does not count."""
    found: dict[str, str] = {}
    taken = set[str]()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9.+*-]+", "_", name).strip("._") or "unnamed"
        plain = plain.replace("*", "star")
        slug, number = plain, 1
        while slug.lower() in taken:
            number += 1
            slug = f"{plain}_{number}"
        taken.add(slug.lower())
        found[name] = slug
    return found
