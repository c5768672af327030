"""Finished runs of one planner on one problem, rated in one currency: by proven answers.

A log holds each improvement of the best solution, and what it had cost in evaluations and collision
queries. So planners of any kind are compared in one currency after the fact, and the logs need not
know of it. Verdicts take long and follow from log and code alone: they are kept in the cache.
"""

import contextlib
import hashlib
import json
import re
import sys
from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import joblib
import numpy as np
import pandas as pd

from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition
from evoexp.numeric.cache_folder import cache_root, read_kept, write_kept
from evoexp.numeric.compilation import sources_key
from evoexp.paths.motion import Motion
from evoexp.planners.answers import judge_motion
from evoexp.records import FloatArray
from evoexp.registry import COMPONENTS, registrations
from evoexp.report.results.run_measures import grouped
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
    # Configurations judged since the start, the task's own (`Planner.prior_queries`)
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

    Solutions of infinite cost and solutions without motion, such as a posture that is held, have no
    row. They are judged on all cores.
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


MULTIPLES = (np.inf, 4.0, 3.0, 2.0, 1.5, 1.2, 1.1, 1.05)  # [-] of a problem's unit of length
_SEPARATORS = re.compile(r" · |: |, | – | - ")  # between the parts of a label


class Problem(NamedTuple):
    """A task that planners are compared on."""

    name: str  # that pages show
    # Of robot and scenario, 12 hex digits, see `problem_key`; empty where nobody knows them
    key: str = ""
    straight: float = np.nan  # distance from start to goal [rad, m]; NaN where goals differ
    # Length of the shortest proven answer known before these runs were compared [rad, m], see
    # `best_known`; NaN: none is stored
    best_known: float = np.nan

    @property
    def unit(self) -> float:
        """Length whose multiples are targets [rad, m]; NaN: any proven answer is the only one."""
        if not np.isnan(self.best_known):
            return self.best_known
        return self.straight if self.straight > 0.0 else np.nan

    @property
    def targets(self) -> tuple[float, ...]:
        """Lengths that answers are to fall below [rad, m]; inf: any proven answer."""
        if np.isnan(self.unit):
            return MULTIPLES[:1]
        return tuple(multiple * self.unit for multiple in MULTIPLES)


class PlannerRuns(NamedTuple):
    """Finished runs of one planner on one problem."""

    planner: str  # its name in figures
    problem: Problem  # that it was run on
    label: str  # of both, in tables
    # Its answers in order; columns replicate, collision_queries, length and certified
    table: pd.DataFrame
    replicates: tuple[int, ...]  # (runs,) in order
    # (runs,) collision queries of the whole runs, the task's own included
    spent: FloatArray
    # That was run; None: the runs were given, nobody here judged them
    condition: ConditionResults | None

    def first_reached(
        self,
        longest: float = np.inf,
        effort: str = "collision_queries",
        spent: FloatArray | None = None,
    ) -> tuple[FloatArray, np.ndarray]:
        """Return the effort of each run up to an answer that is so short, and whether it has one.

        The effort, a column, is that of the whole run, `spent` (runs,), where no proven answer is
        at most `longest` [rad, m].
        """
        good = self.table[self.table["certified"] & (self.table["length"] <= longest)]
        first = good.groupby("replicate")[effort].min().reindex(self.replicates)
        reached = first.notna().to_numpy()
        whole = self.spent if spent is None else spent
        return np.where(reached, first.to_numpy(np.float64, na_value=0.0), whole), reached

    def efforts(self, longest: float = np.inf) -> FloatArray:
        """Return the queries of each run up to an answer that is so short, (runs,); inf: never."""
        effort, reached = self.first_reached(longest)
        return np.where(reached, effort, np.inf)

    @property
    def best_lengths(self) -> FloatArray:
        """Least length of a proven answer of each run, (runs,) [rad, m]; inf: none is proven."""
        proven = self.table[self.table["certified"]].groupby("replicate")["length"].min()
        return proven.reindex(self.replicates).to_numpy(np.float64, na_value=np.inf)


def stored_conditions(runs: Iterable[PlannerRuns]) -> tuple[ConditionResults, ...]:
    """Return the conditions of those runs that were not given."""
    return tuple(own.condition for own in runs if own.condition is not None)


def problem_key(condition: Condition) -> str:
    """Return 12 hex digits of robot and scenario: of all that a condition's problem consists of."""
    parts = {"robot": condition.robot.canonical(), "scenario": condition.scenario.canonical()}
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def of_results(
    conditions: Sequence[ConditionResults], known: Mapping[str, float] | None = None
) -> list[PlannerRuns]:
    """Return the runs of conditions, in order, with their answers judged.

    Conditions of a problem that nobody has a motion for are left out: their answers are of another
    kind. A planner without a motion where others have one has failed, and stays. `known` are the
    best known lengths [rad, m] by the keys of problems.
    """
    found = answers_of(conditions)
    moving = {_task(c) for c in conditions if len(found[c.label])}
    kept = [c for c in conditions if _task(c) in moving]
    if not kept:
        return []
    names = problem_names(kept)
    problems = {}
    for task, own in _by_task(kept).items():
        key = problem_key(own[0].condition)
        tables = [found[c.label] for c in own if len(found[c.label])]
        straight = straight_line(pd.concat(tables))
        problems[task] = Problem(names[task], key, straight, (known or {}).get(key, np.nan))
    planners = planner_names(kept, names)
    return [
        PlannerRuns(
            planners[c.label],
            problems[_task(c)],
            c.label,
            found[c.label],
            tuple(int(k) for k in c.summaries.index),
            # the configurations that the task itself says to be free or not, as a map does
            c.column("collision_queries") + int(planner.prior_queries(problem)),
            c,
        )
        for c in kept
        for planner, problem in (c.prepared,)
    ]


def problem_names(conditions: Sequence[ConditionResults]) -> dict[Hashable, str]:
    """Return a name for each problem: what the labels of its conditions, and no others, share.

    Where its labels share nothing, or there is but one: the name of the scenario's option that was
    taken, or of its component; with a number where several have one name.
    """
    groups = _by_task(conditions)
    parts = {task: [_parts(c) for c in own] for task, own in groups.items()}
    names: dict[Hashable, str] = {}
    for task, own in parts.items():
        others = {p for other in groups if other != task for each in parts[other] for p in each}
        shared = [p for p in own[0] if all(p in each for each in own) and p not in others]
        names[task] = ", ".join(dict.fromkeys(shared)) if len(conditions) > 1 else ""
        if not names[task]:
            c = groups[task][0]
            taken = [option.name for option in c.options if option.group == "scenario"]
            names[task] = taken[0] if taken else str(c.scenario.component)
    every, seen = list(names.values()), Counter[str]()
    for task, name in names.items():
        seen[name] += 1
        if every.count(name) > 1:
            names[task] = f"{name} {seen[name]}"
    return names


def planner_names(
    conditions: Sequence[ConditionResults], problems: dict[Hashable, str]
) -> dict[str, str]:
    """Return the planner's name of each condition, by its label.

    Of one problem each condition is a planner. Of several, a planner's name is what its labels have
    beside the problem's, if each such name stands for one component and one of them at least occurs
    on two problems; else it is the component, with a number where its settings differ.
    """
    if len(_by_task(conditions)) == 1:
        return {c.label: c.label for c in conditions}
    everywhere = set.intersection(*(set(_parts(c)) for c in conditions))
    rest: dict[str, str] = {}
    for c in conditions:
        problem = set(problems[_task(c)].split(", ")) | everywhere
        rest[c.label] = ", ".join(p for p in _parts(c) if p not in problem)
    every = {(_task(c), rest[c.label]) for c in conditions}
    kinds = {(rest[c.label], c.condition.planner.component) for c in conditions}
    num_names = len(set(rest.values()))
    unique = len(every) == len(conditions) and len(kinds) == num_names
    if unique and all(rest.values()) and num_names < len(conditions):
        return rest
    alike = grouped(conditions, lambda c: c.condition.planner)
    different = [own[0].condition.planner for own in alike]
    names = {}
    for c in conditions:
        planner = c.condition.planner
        same = [other for other in different if other.component == planner.component]
        number = f" {same.index(planner) + 1}" if len(same) > 1 else ""
        names[c.label] = f"{planner.component}{number}"
    return names


def _parts(c: ConditionResults) -> list[str]:
    return _SEPARATORS.split(c.label)


def _task(c: ConditionResults) -> Hashable:
    return c.robot, c.scenario


def _by_task(
    conditions: Sequence[ConditionResults],
) -> dict[Hashable, tuple[ConditionResults, ...]]:
    return {_task(own[0]): own for own in grouped(conditions, _task)}
