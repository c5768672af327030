"""Runs as IOHprofiler has them: read back by a plain reader that does as iohinspector does."""

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evoexp.report.results.comparison_files import NO_ANSWER, ioh_files, run_rows
from evoexp.report.results.planner_runs import PlannerRuns, of_results
from evoexp.report.results.stored_results import Results
from report_samples import made_up_runs


class Run(NamedTuple):
    """A run, as it is read."""

    algorithm: str
    function: tuple[int, str]
    dimension: int
    seed: int
    evals: int
    best: tuple[int, float]
    rows: list[tuple[int, float]]


def read(folder: Path) -> list[Run]:
    """Return the runs of a folder; a run begins wherever the number of evaluations is 1."""
    found = []
    for path in sorted(folder.glob("**/*.json")):
        data = json.loads(path.read_text(), parse_constant=lambda name: 1 / 0)
        assert data["maximization"] is False and data["version"] and data["suite"]
        function = data["function_id"], data["function_name"]
        for scenario in data["scenarios"]:
            header, *lines = (path.parent / scenario["path"]).read_text().splitlines()
            assert header.split() == data["attributes"] == ["evaluations", "raw_y"]
            rows = [line.split() for line in lines if line != header]
            numbers = [(int(evaluations), float(y)) for evaluations, y in rows]
            # iohinspector drops rows that repeat the value before them, whatever their run
            kept = numbers[:1] + [b for a, b in pairwise(numbers) if b[1] != a[1]]
            starts = [k for k, row in enumerate(kept) if row[0] == 1]
            spans = pairwise([*starts, len(kept)])
            for run, (start, end) in zip(scenario["runs"], spans, strict=True):
                best = run["best"]
                assert set(best) == {"evals", "y", "x"} and run["instance"] == 1
                head = data["algorithm"]["name"], function, scenario["dimension"], run["seed"]
                found.append(Run(*head, run["evals"], (best["evals"], best["y"]), kept[start:end]))
    return found


def written(runs: list[PlannerRuns], folder: Path) -> list[Run]:
    for name, content in ioh_files(runs).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return read(folder)


def test_stored_runs_are_read_back(results: Results, tmp_path: Path) -> None:
    runs = of_results(results.evolved)
    found = written(runs, tmp_path)
    assert len(found) == sum(len(own.replicates) for own in runs)
    for own in runs:
        for k, replicate in enumerate(own.replicates):
            (run,) = (r for r in found if (r.algorithm, r.seed) == (own.planner, replicate))
            assert run.function == (1, own.problem.name) and run.dimension == 4
            assert run.evals == own.spent[k]
            best = own.best_lengths[k]
            assert run.best[1] == run.rows[-1][1]
            assert run.best[1] == best if np.isfinite(best) else run.best[1] >= NO_ANSWER
            for longest in (np.inf, 1.2 * best, best):
                effort, reached = own.first_reached(longest)
                limit = min(longest, 0.99 * NO_ANSWER)
                first = next((n for n, y in run.rows if y <= limit), None)
                assert first == (int(effort[k]) if reached[k] else None)


def test_runs_without_an_answer_are_not_lost(tmp_path: Path) -> None:
    rows = [(1, 1, 7.0), (1, 1, 6.0), (1, 9, 6.5), (1, 9, 5.0), (1, 20, 5.0), (4, 3, 5.0)]
    own = made_up_runs("A", "p", rows, [10.0, 99.0, 20.0, 30.0, 3.0])
    found = written([own], tmp_path)
    assert [run.seed for run in found] == [0, 1, 2, 3, 4]
    assert [run.evals for run in found] == [10, 99, 20, 30, 3]
    assert found[1].rows == [(1, 6.0), (9, 5.0)] and found[1].best == (9, 5.0)
    assert found[4].rows[1:] == [(3, 5.0)] and found[4].rows[0][1] >= NO_ANSWER
    assert all(run.best[1] >= NO_ANSWER for run in found if run.seed in (0, 2, 3))
    assert run_rows(own, 1, 99.0, math.inf) == [(1, 6.0), (9, 5.0), (99, 5.0)]  # its end, too


def test_names_that_files_cannot_have_stay_apart(tmp_path: Path) -> None:
    names = ["a/b", "a b", "A_B", "../..", "λ", "con*", "x" * 30]
    runs = [made_up_runs(name, f"{name}?", [(0, 5, 2e6)], [9.0]) for name in names]
    paths = [path.split("/") for path in ioh_files(runs)]
    assert all(len(parts) in (2, 3) and ".." not in parts for parts in paths)
    assert len({parts[0].lower() for parts in paths}) == len(names)
    found = written(runs, tmp_path)
    assert {run.algorithm for run in found} == set(names)
    assert {run.function for run in found} == {(k, f"{n}?") for k, n in enumerate(names, 1)}
    assert all(run.rows == [(1, 1e7), (5, 2e6)] for run in found)  # above every length
