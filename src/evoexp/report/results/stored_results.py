"""Stored results of the conditions that a report is asked for."""

import functools
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from evoexp.condition import Condition, Prepared
from evoexp.errors import NothingStored
from evoexp.paths.motion import Motion
from evoexp.planners.planner import WrappedPlanner
from evoexp.records import FloatArray
from evoexp.shipped import ORIGIN, Option, config_directory, shipped
from evoexp.store.files import warn
from evoexp.store.identity import DamagedFile, Plan
from evoexp.store.log_reader import read_log, read_solution
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import damaged_logs, read_generations, read_summaries

Kind = TypeVar("Kind")
# the field of a control (random search) that holds the planner it stands beside
WRAPPED = "planner"


def wrapped(planner: Any) -> Any:
    """Return the planner that a control or a reference stands beside; of others themselves."""
    return planner.planner if isinstance(planner, WrappedPlanner) else planner


class Verdicts(NamedTuple):
    """Counts of the exact verdicts on the motions of a condition's finished replicates."""

    judged: int  # motions
    certified: int  # free of contact
    refuted: int  # in contact somewhere
    undecided: int  # neither proven
    solved_refuted: int  # accepted by the paper's own model and refuted
    with_margin: int  # that never come closer than the security margin
    margin_broken: int  # that do, and touch nothing: certified, required margin not kept


@dataclass(frozen=True, eq=False)
class ConditionResults:
    """One condition's replicates as far as they are stored and planned.

    The content of their logs is read at its first use: a page that draws no convergence reads no
    generation. Thousands of logs are opened one by one, and only the columns stay in memory.
    """

    label: str  # its name in figures
    condition: Condition  # the condition that was run
    # Number of planned replicates: by the experiment or, where more were asked for or are stored,
    # that many
    planned: int
    summaries: pd.DataFrame  # one row per finished replicate, indexed by replicate, in order
    failures: dict[int, str]  # replicate → reason of its failure
    run: RunDirectory  # directory of the logs
    code: dict[str, Any]  # version, commit and dirty flag of the code that created the run
    # The option that was taken of each group; empty where nothing records it
    options: tuple[Option, ...] = ()
    # The numbers of replicates that were asked for, in order; empty where nothing records them
    plans: tuple[Plan, ...] = ()
    # Name → what is wrong with it, of the logs that are left out
    damaged: Mapping[str, str] = field(default_factory=dict)

    @functools.cached_property
    def generations(self) -> pd.DataFrame:
        """One row per generation of every finished replicate."""
        return read_generations(self.run, self.summaries.index.tolist())

    @functools.cached_property
    def solutions(self) -> dict[int, FloatArray]:
        """Replicate → its best solution, flat."""
        logs = {int(k): self.run.log_path(int(k)) for k in self.summaries.index}
        return {k: read_solution(path).values for k, path in logs.items()}

    def first_solution(self, replicate: int) -> FloatArray:
        """Return the best of the initial population of a replicate."""
        return read_log(self.run.log_path(replicate)).solutions[0].values

    def array(self, name: str) -> NDArray[Any]:
        """Return an array attached to the log of the best replicate."""
        return read_log(self.run.log_path(self.best_replicate)).arrays()[name]

    @property
    def hash12(self) -> str:
        """The twelve hex digits that name the run."""
        return self.condition.id[:12]

    @property
    def done(self) -> int:
        """Number of finished replicates."""
        return len(self.summaries)

    def added(self, fixed: int) -> int:
        """Return how many finished replicates were asked for when results were there already."""
        known = [max(fixed, plan.num_replicates) for plan in self.plans if not plan.stored]
        seen = [plan.num_replicates for plan in self.plans if plan.stored]
        if not seen:
            return 0
        return int(np.count_nonzero(self.summaries.index >= max([fixed, *known])))

    @property
    def solved(self) -> int:
        """Number of finished replicates whose best solution the paper's own model accepts."""
        return int(self.summaries["solved"].sum())

    @property
    def verdicts(self) -> Verdicts:
        """Count of the exact verdicts."""
        motions = self.summaries[~np.isnan(self.column("clearance"))]
        certified, refuted, margin, broken = (
            motions[name].eq(value).fillna(False)
            for name, value in itertools.product(("certified", "certified_margin"), (True, False))
        )
        rows = certified, refuted, motions["certified"].isna(), refuted & motions["solved"]
        return Verdicts(len(motions), *(int(r.sum()) for r in (*rows, margin, broken & certified)))

    @property
    def best_replicate(self) -> int:
        """Replicate of the lowest best cost; among equals the first."""
        return int(self.summaries.index[int(np.argmin(self.column("best_cost")))])

    @property
    def prepared(self) -> Prepared:
        """Planner and problem, to judge solutions with."""
        return self.condition.prepare()

    def problem(self, kind: type[Kind]) -> Kind:
        """Return the problem that the planner prepared, of the public type that a page expects."""
        found = self.prepared.problem
        if not isinstance(found, kind):
            raise TypeError(f"{self.label}: a {kind.__qualname__} is expected, was {type(found)}")
        return found

    def evaluate(self, solution: FloatArray) -> dict[str, float]:
        """Return the named terms of a solution, as the planner's `evaluate` tells them."""
        planner, problem = self.prepared
        return dict(planner.evaluate(problem, solution))

    def motion(self, replicate: int) -> Motion:
        """Return the motion of a replicate's best solution, which must be one."""
        planner, problem = self.prepared
        found = planner.motion(problem, self.solutions[replicate])
        if not isinstance(found, Motion):
            raise TypeError(f"{self.label}: its solutions are no motions")
        return found

    @property
    def robot(self) -> Any:
        """The robot."""
        return self.condition.robot

    @property
    def scenario(self) -> Any:
        """The scene and the task."""
        return self.condition.scenario

    @property
    def length_unit(self) -> str:
        """Unit of lengths in the scene."""
        return self.condition.length_unit

    @property
    def planner(self) -> Any:
        """The paper's planner; of a control or a reference the planner that it stands beside."""
        return wrapped(self.condition.planner)

    @property
    def is_control(self) -> bool:
        """Return whether this is a control: a planner that stands beside the paper's."""
        return isinstance(self.condition.planner, WrappedPlanner) and not self.is_reference

    @property
    def is_reference(self) -> bool:
        """Return whether this is a reference: a truth that stands beside the planners."""
        return self.condition.is_reference

    def column(self, name: str) -> FloatArray:
        """Return a column of the summaries as floats, (done,); NaN where there is none."""
        if name not in self.summaries:
            return np.full(self.done, np.nan)
        return self.summaries[name].to_numpy(dtype=np.float64, na_value=np.nan)


class Results(NamedTuple):
    """Everything that a report is drawn from."""

    experiment: str  # name of the experiment; empty for runs given by their hashes
    budget: str  # name of the budget; empty for runs given by their hashes
    conditions: tuple[ConditionResults, ...]  # in the order of the experiment
    outputs: Path = Path()  # root of the outputs that they were read from
    as_written: bool = False  # whether the experiment was asked for without overrides
    searched: Any = None  # the trials of a search of settings (`trials.Searched`)

    @property
    def with_data(self) -> tuple[ConditionResults, ...]:
        """Conditions of which at least one replicate is finished."""
        return tuple(condition for condition in self.conditions if condition.done)

    @property
    def main(self) -> tuple[ConditionResults, ...]:
        """Conditions with data without controls and references; controls if there are no others."""
        return tuple(c for c in self.evolved if not c.is_control) or self.evolved

    @property
    def evolved(self) -> tuple[ConditionResults, ...]:
        """Conditions with data without references; references if there are no others."""
        return tuple(c for c in self.with_data if not c.is_reference) or self.with_data

    @property
    def references(self) -> tuple[ConditionResults, ...]:
        """References with data."""
        return tuple(c for c in self.with_data if c.is_reference)

    @property
    def suffixed(self) -> Iterator[tuple[ConditionResults, str]]:
        """Conditions of `main` with the ends of their files' names, empty for a single one."""
        for k, condition in enumerate(self.main):
            slug = re.sub(r"[^a-z0-9]+", "_", condition.label.lower()).strip("_") or str(k)
            yield condition, "" if len(self.main) == 1 else f"_{k + 1}_{slug}"

    def beside(self, experiment: str) -> "Results":
        """Return the stored results of another shipped experiment at the paper's budget."""
        rows = [row for row in shipped() if (row.experiment, row.budget) == (experiment, "paper")]
        runs = {row.label: RunDirectory(self.outputs, row.condition_id) for row in rows}
        found = tuple(
            _read(self.outputs, label, Condition.from_json(run.config_json()), None, None)
            for label, run in runs.items()
            if run.completed()
        )
        return Results(experiment, "paper", found, self.outputs)

    def position(self, label: str) -> int:
        """Return a condition's place in the experiment, which gives it its colour."""
        return [condition.label for condition in self.conditions].index(label)


def gather(
    outputs: Path,
    conditions: Sequence[tuple[str, Condition]],
    num_replicates: int | None,
    experiment: str,
    budget: str,
    command: str,
    options: Mapping[str, tuple[Option, ...]] | None = None,
) -> Results:
    """Read the stored results of (label, condition): every replicate, done or failed.

    At least `num_replicates` are planned of each; `command` helps where nothing is stored.

    Raises:
        NothingStored: If no replicate of any condition is there.
        CorruptLog: If a log cannot be trusted.
    """
    found = tuple(
        _read(outputs, label, condition, num_replicates, (options or {}).get(label))
        for label, condition in conditions
    )
    if not any(condition.done or condition.failures for condition in found):
        told = f"nothing stored in {outputs}; try: {command}"
        raise NothingStored(f"{experiment or 'report'}: {told}")
    return Results(experiment, budget, found, outputs)


def _read(
    outputs: Path,
    label: str,
    condition: Condition,
    num_replicates: int | None,
    options: tuple[Option, ...] | None,
) -> ConditionResults:
    run = RunDirectory(outputs, condition.id)
    is_stored = bool(run.completed() or run.failed())
    if is_stored:
        run.check_identity()
    manifest = run.manifest() if is_stored else {}
    code = {"version": (manifest.get("versions") or {}).get("evoexp")}
    code |= {name: (manifest.get("git") or {}).get(name) for name in ("commit", "dirty")}
    plans: tuple[Plan, ...] = ()
    try:
        plans = tuple(run.plans())
    except DamagedFile as error:
        warn(f"{error}; added replicates are not marked")
    if options is None:  # the manifest's; only shipped ones have files to be read
        recorded: dict[str, dict[str, str]] = manifest.get("options") or {}
        options = tuple(
            Option(group, name, origin, str(folder / f"{name}.yaml") if origin == ORIGIN else "")
            for group, each in recorded.items()
            for name, origin, folder in (
                (each["name"], each["origin"], config_directory() / group),
            )
        )
    rows = read_summaries(run, thorough=True).sort_values("replicate", kind="stable")
    rows = rows.set_index("replicate")
    asked = condition.num_replicates(num_replicates) if num_replicates is not None else 0
    done, failed = rows[rows["status"] == "done"], rows[rows["status"] == "failed"]
    return ConditionResults(
        label,
        condition,
        run.num_planned(asked),
        done,
        dict(zip(map(int, failed.index), map(str, failed["stop_reason"]), strict=True)),
        run,
        code if is_stored else {},
        options,
        plans,
        damaged_logs(run),
    )
