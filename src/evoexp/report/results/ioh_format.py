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
import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

from evoexp.report.results.planner_runs import PlannerRuns

VERSION = "0.3.18"  # of IOHexperimenter, whose files these are like
SUITE = "evoexp"
INSTANCE = 1  # seeds are repetitions on one instance of a problem
NO_ANSWER = 1e6  # [rad, m] longer than any path; ten times as much where a given one is not
HEADER = ("evaluations", "raw_y")
Rows = list[tuple[int, float]]


def ioh_files(runs: Sequence[PlannerRuns]) -> dict[str, bytes]:
    """Return the contents of all files by their paths in the folder, problems numbered from 1."""
    problems = list(dict.fromkeys(own.problem.name for own in runs))
    folders = _slugs(dict.fromkeys(own.planner for own in runs))
    names, dimensions = _slugs(problems), {name: _dimension(runs, name) for name in problems}
    # for no answer stands a power of ten above all lengths
    longest = max((float(own.table["length"].max()) for own in runs if len(own.table)), default=1.0)
    nothing = max(NO_ANSWER, 10.0 ** (math.floor(math.log10(longest)) + 1))
    cells: dict[tuple[str, str], list[PlannerRuns]] = {}
    for own in runs:
        cells.setdefault((own.planner, own.problem.name), []).append(own)
    files: dict[str, bytes] = {}
    for (planner, problem), same in cells.items():
        summaries, lines = list[dict[str, Any]](), list[str]()
        for own in same:
            for seed, spent in zip(own.replicates, own.spent, strict=True):
                rows = run_rows(own, seed, float(spent), nothing + len(summaries))
                evaluations, y = rows[-1]
                best = {"evals": min(at for at, value in rows if value == y), "y": y, "x": []}
                run = {"instance": INSTANCE, "evals": evaluations, "best": best, "seed": seed}
                summaries.append(run)
                lines += [" ".join(HEADER), *(f"{at} {value!r}" for at, value in rows)]
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
            "scenarios": [{"dimension": size, "path": data, "runs": summaries}],
        }
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        folder = folders[planner]
        files[f"{folder}/IOHprofiler_f{number}_{names[problem]}.json"] = text.encode()
        files[f"{folder}/{data}"] = "\n".join([*lines, ""]).encode()
    return files


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


def _dimension(runs: Sequence[PlannerRuns], problem: str) -> int:
    """Return the number of joints of a problem's motions; 0 where nobody here knows it."""
    conditions = (own.condition for own in runs if own.problem.name == problem and own.condition)
    motions = (
        c.prepared.planner.motion(c.prepared.problem, solution)
        for c in conditions
        for solution in c.solutions.values()
    )
    return next((int(motion.q.shape[1]) for motion in motions if motion is not None), 0)


def _slugs(names: Iterable[str]) -> dict[str, str]:
    """Return a name for files of each name, all different, also where case does not count."""
    slugs: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9.+-]+", "_", name.replace("*", "star")).strip("._") or "unnamed"
        slug = plain
        while slug.lower() in {taken.lower() for taken in slugs.values()}:
            slug = f"{plain}_{len(slugs) + 1}"
            plain = slug
        slugs[name] = slug
    return slugs
