"""Every solution that a run logged on its way, judged by the exact certifier, and its length.

A log holds each improvement of the best solution, and what it had cost in evaluations and collision
queries. So planners of any kind are compared in one currency after the fact, and the logs need not
know of it. Verdicts take long and follow from log and code alone: they are kept in the cache.
"""

import contextlib
import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import joblib
import numpy as np
import pandas as pd

from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition
from evoexp.numeric.cache_folder import cache_root, read_kept, write_kept
from evoexp.numeric.kernel_folders import sources_key
from evoexp.paths.motion import Motion
from evoexp.planners.proofs import judge_motion
from evoexp.records import FloatArray
from evoexp.registry import COMPONENTS, registrations
from evoexp.report.results.stored_results import ConditionResults
from evoexp.store.log_reader import read_log

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)  # per cubic segment
WORTH_WORKERS = 16  # logs to judge, from which on worker processes are started
CLOSE = 1e-6  # [rad] by which goals may differ and be the same


class Answer(NamedTuple):
    """One improvement of a run's best solution."""

    replicate: int  # of the run
    generation: int  # in which it was found
    evaluations: int  # since the start
    # Configurations judged since the start, those that the task tells of (`Planner.prior_queries`)
    # included
    collision_queries: int
    length: float  # of the joints' path [rad, m]
    straight: float  # distance of its ends, which no path is shorter than [rad, m]
    solved: bool  # whether the planner's own model accepts it
    certified: bool  # whether the exact certifier proves it, and it is a solution of the task
    # CPU time of the run until it was logged [s]; NaN where the log does not tell
    cpu_s: float = np.nan


def answers_of(conditions: Sequence[ConditionResults]) -> dict[str, pd.DataFrame]:
    """Return the answers of all finished replicates, by the labels of conditions.

    Solutions of infinite cost, and those that are no motions, such as a posture that is held, have
    no row. They are judged on all cores.
    """
    guests = {each.module.partition(".")[0] for each in registrations(COMPONENTS)}
    loaded = sorted(name for name in guests if name in sys.modules)
    code = "".join(map(sources_key, loaded)).encode() + Path(__file__).read_bytes()
    logs = [(c, int(k), c.run.log_path(int(k))) for c in conditions for k in c.summaries.index]
    times, kept = list[FloatArray](), dict[Path, list[list[Any]]]()
    places = dict[Path, Path]()  # log → where its answers are kept
    for condition, _, path in logs:
        log = read_log(path)
        times.append(log.cpu_s)
        key = hashlib.sha256(code)
        key.update(f"{condition.condition.id} {log.content_digest}".encode())
        places[path] = cache_root() / "answers" / key.hexdigest()[:32]
        if (content := read_kept(places[path])) is not None:
            kept[path] = json.loads(content)
    # a log alone is enough for a worker, which loads pinocchio before it judges
    unjudged = [path for _, _, path in logs if path not in kept]
    parallel = joblib.Parallel(n_jobs=-1 if len(unjudged) >= WORTH_WORKERS else 1)
    judged = parallel(joblib.delayed(_judged)(path) for path in unjudged)
    for path, own in zip(unjudged, judged, strict=True):
        kept[path] = own
        with contextlib.suppress(OSError):
            write_kept(places[path], json.dumps(own).encode())
    found: dict[str, list[Answer]] = {c.label: [] for c in conditions}
    for (condition, replicate, path), cpu_s in zip(logs, times, strict=True):
        found[condition.label] += [
            Answer(replicate, *answer)._replace(cpu_s=float(cpu_s[answer[0]]))
            for answer in kept[path]
        ]
    return {label: answer_table(own) for label, own in found.items()}


def answer_table(found: Sequence[Answer]) -> pd.DataFrame:
    """Return answers as a table, its columns of the same types where there are none."""
    return pd.DataFrame(found, columns=list(Answer._fields)).astype(Answer.__annotations__)


def motion_length(motion: Motion) -> float:
    """Return the length of a path in joint space [rad, m], of cubics by quadrature."""
    if motion.coefficients is None:
        steps = np.diff(motion.q, axis=0)
        return float(np.sqrt((steps * steps).sum(axis=1)).sum())
    _, c1, c2, c3 = motion.coefficients.transpose(1, 0, 2)  # each (segments, nq)
    total = 0.0
    for node, weight in zip(0.5 * (NODES + 1.0), 0.5 * WEIGHTS, strict=True):
        speed = c1 + node * (2.0 * c2 + node * 3.0 * c3)
        total += float(weight * np.sqrt((speed * speed).sum(axis=1)).sum())
    return total


def straight_line(table: pd.DataFrame) -> float:
    """Return the distance from start to goal; NaN where goals are not all the same."""
    far = table["straight"].to_numpy(np.float64)
    return float(far[0]) if len(far) and np.ptp(far) < CLOSE else np.nan


def _judged(path: Path) -> list[list[Any]]:
    """Judge the answers of a log; they lack the replicate and the CPU time of `Answer`."""
    log = read_log(path)
    keep_all(data for name, data in log.attachments.items() if name.startswith(PREFIX))
    planner, problem = Condition.from_json(log.config_json).prepare()
    known = planner.prior_queries(problem)
    found = list[list[Any]]()
    for row in log.solutions:
        if not np.isfinite(row.cost):  # infeasible, as the planner says itself
            continue
        motion = planner.motion(problem, row.values)
        if motion is None or not (length := motion_length(motion)):
            continue
        at = log.generations[row.generation]
        reached = at.solved or not planner.goal_is_region
        proven = (
            bool(reached)
            and judge_motion(planner, problem, motion).certified is True
            and not planner.departures(problem, row.values)
        )
        ends = motion.q[-1] - motion.q[0]
        straight = float(np.sqrt((ends * ends).sum()))
        counts = row.generation, at.evaluations, known + at.collision_queries
        found.append([*counts, length, straight, bool(at.solved), proven])
    return found
