"""Runs the missing replicates of conditions in worker processes and stores their logs.

Descriptions go out and bytes come back; only the calling process writes. A finished log is the only
mark of completion, so an interrupted batch is resumed by asking for it again.
"""

import contextlib
import itertools
import json
import re
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import joblib
import numpy as np
from joblib.externals.loky.process_executor import TerminatedWorkerError

from evoexp.batch.jobs import Job, Outcome, load, run_jobs
from evoexp.batch.memory_limit import allowed_memory, refuse_large
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.batch.workers import in_workers, loading, num_cores
from evoexp.condition import Condition
from evoexp.numeric.kernel_cache import is_compiled, note_compiled
from evoexp.paths.motion import Motion
from evoexp.planners.planner import judge_motion
from evoexp.records import ReplicateSummary
from evoexp.registry import component_modules, guests
from evoexp.store.identity import MANIFEST, restored_manifest
from evoexp.store.manifest import manifest
from evoexp.store.mending import lost_replicates, mend, needs_mending
from evoexp.store.run_directory import RunDirectory, create_all, lock_all
from evoexp.store.summaries import whole_logs, write_summary

# [s] replicates are bundled into tasks of about this length; a task costs the parent some 2 ms
TASK_S = 0.2
MAX_BUNDLE = 64  # replicates per task at most, so that results keep streaming
_NUMBER = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")


class Batch:
    """All replicates that are asked for, of any number of conditions.

    Attributes:
        runs: One run directory per distinct condition.
        jobs: The missing replicates, condition by condition; those whose log is damaged are, too.
        is_damaged: Whether stored files of a run are damaged, which `run` mends.
    """

    def __init__(
        self,
        conditions: Iterable[tuple[Condition, int, dict[str, Any]]],
        settings: RunnerSettings,
        outputs: Path,
    ) -> None:
        """Plan; nothing is written yet but summary tables that were out of date.

        Args:
            conditions: (condition, number of replicates, notes for the manifest of a new run); one
                may occur twice.
            settings: Number of workers, and where they run.
            outputs: Root of all outputs.
        """
        self._settings, self._outputs = settings, outputs
        self._wanted: dict[str, tuple[Condition, int, dict[str, Any]]] = {}
        for condition, count, notes in conditions:
            known = self._wanted.get(condition.id)
            self._wanted[condition.id] = (
                condition,
                max(count, known[1] if known else 0),
                known[2] if known else notes,
            )
        self.runs = {key: RunDirectory(outputs, key) for key in self._wanted}
        for run in self.runs.values():
            whole_logs(run, thorough=True)  # what is damaged is known from here on
        self.jobs = self._missing({key: lost_replicates(run) for key, run in self.runs.items()})
        self.is_damaged = any(
            needs_mending(run, self._wanted[key][0].to_json()) for key, run in self.runs.items()
        )
        self._finished: dict[str, dict[int, ReplicateSummary]] = {}  # by this batch, per condition
        self._summarised: set[str] = set()  # conditions whose table is written

    def prepare(self) -> None:
        """Check every condition against its robot and scenario, before anything is written.

        Raises:
            SettingError: If one contradicts itself, or takes more memory than there is.
        """
        allowed = allowed_memory(self._settings, self._num_workers())
        missing = {job.condition_id for job in self.jobs}
        for key, (condition, _, notes) in self._wanted.items():
            condition.prepare()
            if key in missing:
                refuse_large(condition, allowed, notes.get("label", ""))

    def run(self) -> Generator[Outcome, None, None]:
        """Mend the runs, run the missing replicates; yield every outcome once it is stored.

        Closing the iterator keeps the finished replicates.

        Raises:
            Busy: If another process writes one of the runs.
        """
        with lock_all(self.runs.values()):
            lost = {key: lost_replicates(run) for key, run in self.runs.items()}
            for key, run in self.runs.items():
                mend(run, self._wanted[key][0].to_json())
            self.jobs = self._missing(lost)
            num_workers = self._num_workers()
            config_jsons = list(dict.fromkeys(job.condition_json for job in self.jobs))
            files = list(dict.fromkeys(content for job in self.jobs for content in job.files))
            with loading(num_workers, load, config_jsons, files):
                wanted = ((run, *self._wanted[key]) for key, run in self.runs.items())
                create_all(
                    (run, text, _manifest(run, text) | notes, own.files())
                    for run, own, _, notes in wanted
                    for text in (own.to_json(),)
                )
                for key in dict.fromkeys(job.condition_id for job in self.jobs):
                    self.runs[key].note_plan(self._wanted[key][1])
                _compile(config_jsons)
            try:
                for outcomes in fan_out(self.jobs, num_workers):
                    yield from self._store(outcomes)
            except OSError:  # a full disk: the table can be built from the logs at any time
                raise
            except BaseException:
                with contextlib.suppress(OSError):
                    self._summarise_all()
                raise
            self._summarise_all()

    def _num_workers(self) -> int:
        return max(1, min(self._settings.num_workers or num_cores(), len(self.jobs)))

    def _missing(self, lost: Mapping[str, set[int]]) -> list[Job]:
        """Return the jobs of missing replicates; references, which take longest, come first.

        Args:
            lost: Condition → replicates whose log is damaged, whether or not they are asked for.
        """
        jobs = []
        ordered = sorted(self._wanted.items(), key=lambda item: not item[1][0].is_reference)
        for key, (condition, count, _) in ordered:
            config_json, run = condition.to_json(), self.runs[key]
            files = tuple(condition.files().values())
            missing = (set(range(count)) - whole_logs(run)) | lost[key]
            jobs += [Job(key, config_json, index, files) for index in sorted(missing)]
        return jobs

    def _store(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
        """Write failures and logs, and the table of a condition as soon as it is complete."""
        by_run: dict[str, dict[int, bytes]] = {}
        for outcome in outcomes:
            key, replicate = outcome.condition_id, outcome.replicate
            if outcome.summary is None:
                self.runs[key].write_failure(replicate, outcome.reason, outcome.traceback)
            else:
                by_run.setdefault(key, {})[replicate] = outcome.content
                self._finished.setdefault(key, {})[replicate] = outcome.summary
        for key, contents in by_run.items():
            self.runs[key].write_logs(contents)
            if len(self._finished[key]) == self._wanted[key][1]:
                self._summarise(key)  # now, while the workers go on
        return [outcome._replace(content=b"") for outcome in outcomes]

    def _summarise_all(self) -> None:
        for key in self.runs.keys() - self._summarised:
            self._summarise(key)

    def _summarise(self, key: str) -> None:
        write_summary(self.runs[key], self._finished.get(key, {}))
        self._finished.pop(key, None)
        self._summarised.add(key)


def _manifest(run: RunDirectory, config_json: bytes) -> dict[str, Any]:
    """Return the manifest of a run; of one that has lost its own, what a log knows of it."""
    if not (run.path / MANIFEST).exists() and (known := _restored(run)):
        return known
    return manifest(run.condition_id, guests(config_json))


def _restored(run: RunDirectory) -> dict[str, Any]:
    return restored_manifest(run.path, run.condition_id) if run.completed() else {}


def fan_out(jobs: Sequence[Job], num_workers: int) -> Iterator[list[Outcome]]:
    """Run jobs in worker processes; yield outcomes as they come.

    A worker that dies takes the pool with it, and everything in flight: each of those jobs then
    runs alone, so that only the one that kills its worker fails; the others go on in a new pool.
    """
    waiting = deque(jobs)
    while waiting:
        if num_workers == 1:
            yield run_jobs([waiting.popleft()])
            continue
        in_flight: dict[tuple[str, int], Job] = {}
        bundles = _Bundles(waiting, in_flight, num_workers)
        try:
            for outcomes in in_workers(
                num_workers, (joblib.delayed(run_jobs)(bundle) for bundle in bundles)
            ):
                bundles.took(outcomes)
                yield outcomes
        except TerminatedWorkerError:
            for job in list(in_flight.values()):
                yield [_run_alone(job)]


class _Bundles:
    """Takes waiting jobs into tasks of about `TASK_S`, by the times seen of late.

    Before any is seen, tasks are long, and end when they take too long: replicates that need the
    same library stand together, and are best run where it is loaded.
    """

    def __init__(
        self, waiting: deque[Job], in_flight: dict[tuple[str, int], Job], num_workers: int
    ) -> None:
        self._waiting, self._in_flight, self._num_workers = waiting, in_flight, num_workers
        self._bundles: dict[tuple[str, int], list[Job]] = {}  # those in flight, by their first jobs
        self._seconds, self._count = 0.0, 0.0

    def __iter__(self) -> Iterator[list[Job]]:
        while self._waiting:
            mean = self._seconds / self._count if self._count else 0.0
            fair = -(-len(self._waiting) // (2 * self._num_workers))
            size = max(1, min(MAX_BUNDLE, fair, int(TASK_S / max(mean, 1e-6))))
            bundle = [self._waiting.popleft() for _ in range(min(size, len(self._waiting)))]
            for job in bundle:
                self._in_flight[job.key] = job
            self._bundles[bundle[0].key] = bundle
            yield bundle

    def took(self, outcomes: Sequence[Outcome]) -> None:
        """Note the outcomes of a task; jobs that it did not begin wait again.

        Earlier times count half from now on, so that slow first jobs are soon forgotten.
        """
        left = self._bundles.pop((outcomes[0].condition_id, outcomes[0].replicate))[len(outcomes) :]
        for job in reversed(left):
            del self._in_flight[job.key]
            self._waiting.appendleft(job)
        self._seconds, self._count = self._seconds / 2.0, self._count / 2.0
        for outcome in outcomes:
            self._seconds += outcome.wall_s
            self._count += 1
            self._in_flight.pop((outcome.condition_id, outcome.replicate), None)


def _run_alone(job: Job) -> Outcome:
    """Run one job in a process of its own, and once more if that dies.

    Which job had brought the pool down is not known.
    """
    trace = ""
    for _ in range(2):
        try:
            ((outcome,),) = in_workers(2, [joblib.delayed(run_jobs)([job])])
            return cast(Outcome, outcome)
        except TerminatedWorkerError as error:
            trace = str(error)
    return Outcome(job.condition_id, job.replicate, "worker process died twice", trace, b"", 0.0)


def _compile(config_jsons: Iterable[bytes]) -> None:
    """Compile every kernel that some conditions need, once and here, unless they are kept."""
    for text in config_jsons:
        kind = _NUMBER.sub("0", text.decode())  # another number needs no other kernel
        modules = set(component_modules(json.loads(text)))
        if is_compiled(kind, modules):
            continue
        # A planner that fails does so again in its replicate, and is noted there.
        with contextlib.suppress(Exception):
            condition = Condition.from_json(text)
            planner, problem = condition.prepare()
            # A reference takes long, and mostly needs the kernels of the planner beside it.
            if condition.is_reference:
                planner = planner.planner
            for generation in itertools.islice(planner.evolve(problem, condition.rng(0)), 2):
                planner.evaluate(problem, generation.best)
                motion = planner.motion(problem, generation.best)
                judge_motion(planner, problem, motion)
                # A motion that touches nothing needs the kernels of the closest approach.
                if motion is not None:
                    judge_motion(planner, problem, Motion(np.repeat(motion.q[:1], 2, axis=0)))
            note_compiled(kind, modules)
