"""Runs the missing replicates of conditions in worker processes and stores their logs.

Descriptions go out and bytes come back; only the calling process writes. A finished log is the only
mark of completion, so an interrupted batch is resumed by asking for it again.
"""

import contextlib
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from evoexp.batch import jobs
from evoexp.batch.cluster import cluster_fan_out
from evoexp.batch.jobs import Job, Outcome
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.runner_settings import GIGABYTE, RunnerSettings, allowed_memory, refuse_large
from evoexp.batch.workers import Workers, num_cores
from evoexp.condition import Condition
from evoexp.records import ReplicateSummary
from evoexp.registry import guests
from evoexp.store import identity
from evoexp.store.identity import manifest
from evoexp.store.integrity import lost_replicates, mend
from evoexp.store.run_directory import RunDirectory, lock_all
from evoexp.store.summaries import damaged_logs, whole_logs, write_summary

LEAST_MEMORY = 1.0 * GIGABYTE  # [B] that a replicate may take where nothing is set


class Batch:
    """All replicates that are asked for, of any number of conditions."""

    def __init__(
        self,
        conditions: Iterable[tuple[Condition, int, dict[str, Any]]],
        settings: RunnerSettings,
        outputs: Path,
        *,
        retry_failed: bool = False,
        curves: Path | None = None,
    ) -> None:
        """Plan; nothing is written yet but summary tables that were out of date.

        Args:
            conditions: (condition, number of replicates, notes for the manifest of a new run); one
                may occur twice.
            retry_failed: Whether replicates that failed before run again.
            curves: Folder for the convergence of running replicates; None: it is not told.
        """
        self._curves = curves
        self._settings, self._retry_failed = settings, retry_failed
        self._wanted: dict[str, tuple[Condition, int, dict[str, Any]]] = {}
        for condition, count, notes in conditions:
            _, before, first_notes = self._wanted.get(condition.id, (condition, 0, notes))
            self._wanted[condition.id] = (condition, max(count, before), first_notes)
        self.runs = {key: RunDirectory(outputs, key) for key in self._wanted}  # by condition
        for run in self.runs.values():
            whole_logs(run, thorough=True)  # what is damaged is known from here on
        # the missing replicates, condition by condition; those whose log is damaged are, too
        self.jobs = self._missing({key: lost_replicates(run) for key, run in self.runs.items()})
        self.is_damaged = any(  # of a run, which `run` mends
            run.damaged_files(self._wanted[key][0].to_json()) or damaged_logs(run)
            for key, run in self.runs.items()
        )
        self._finished: dict[str, dict[int, ReplicateSummary]] = {}  # by this batch, per condition

    def prepare(self) -> None:
        """Check conditions with missing replicates, see `refuse_large`; nothing is written yet."""
        allowed = allowed_memory(self._settings, self.num_workers)
        missing = {job.condition_id for job in self.jobs}
        for key, (condition, _, notes) in self._wanted.items():
            if key in missing:
                refuse_large(condition, allowed, notes.get("label", ""))

    def run(self) -> Generator[Outcome, None, None]:
        """Mend the runs, run the missing replicates; yield every outcome once it is stored.

        Closing the iterator keeps the finished replicates. `Busy` is raised where another process
        writes one of the runs.
        """
        with lock_all(self.runs.values()):
            lost = {key: lost_replicates(run) for key, run in self.runs.items()}
            for key, run in self.runs.items():
                condition, count, _ = self._wanted[key]
                mend(run, condition.to_json(), lost[key] | set(range(count)))
            self.jobs = self._missing(lost)
            try:
                with self._workers() as workers:  # they end first of all, however the body ends
                    for key, run in self.runs.items():
                        condition, _, notes = self._wanted[key]
                        config_json = condition.to_json()
                        run.create(
                            config_json, manifest_of(run, config_json) | notes, condition.files()
                        )
                    for key in dict.fromkeys(job.condition_id for job in self.jobs):
                        self.runs[key].note_plan(self._wanted[key][1])
                    for outcomes in self._outcomes(workers):
                        yield from self._store(outcomes)
            except OSError:  # a full disk: the table can be built from the logs at any time
                raise
            except BaseException:
                with contextlib.suppress(OSError):
                    self._summarise(self.runs)
                raise
            self._summarise(self.runs)

    def _workers(self) -> contextlib.AbstractContextManager[Workers | None]:
        """Return worker processes; None where there is one, or where a cluster starts them."""
        if self.num_workers == 1 or self._settings.backend == "dask":
            return contextlib.nullcontext()
        return Workers(self.num_workers)

    def _outcomes(self, workers: Workers | None) -> Iterator[list[Outcome]]:
        allowed = allowed_memory(self._settings, self.num_workers)
        least = 0.0 if self._settings.memory_gb is not None else LEAST_MEMORY
        limits = ReplicateLimits(self._settings.timeout_s, int(max(allowed, least)))
        kinds = jobs.one_of_each_kind(self.jobs)
        if workers is not None:
            workers.call_first(jobs.warm_kernels, kinds, limits)
        elif self._settings.address is None:  # else the workers are elsewhere
            jobs.warm_kernels(kinds, limits)
        if self._settings.backend == "dask":
            return cluster_fan_out(self.jobs, self._settings, limits)
        return jobs.fan_out(self.jobs, workers, limits, self._curves)

    @property
    def num_workers(self) -> int:
        """Number of worker processes; 1: the replicates are run by this process."""
        return max(1, min(self._settings.num_workers or num_cores(), len(self.jobs)))

    @property
    def num_left_failed(self) -> int:
        """Number of replicates that are asked for, failed before, and are not run again."""
        if self._retry_failed:
            return 0
        return sum(
            len(self.runs[key].failed() & set(range(count)))
            for key, (_, count, _) in self._wanted.items()
        )

    def _missing(self, lost: Mapping[str, set[int]]) -> list[Job]:
        """Return the jobs of missing replicates; references, which take longest, come first."""
        missing_jobs = list[Job]()
        ordered = sorted(self._wanted.items(), key=lambda item: not item[1][0].is_reference)
        for key, (condition, count, _) in ordered:
            config_json, run = condition.to_json(), self.runs[key]
            files = tuple(condition.files().values())
            missing = (set(range(count)) - whole_logs(run)) | lost[key]
            missing -= set() if self._retry_failed else run.failed()
            missing_jobs += [Job(key, config_json, index, files) for index in sorted(missing)]
        return missing_jobs

    def _store(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
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
                self._summarise([key])  # now, while the workers go on
        return [outcome._replace(content=b"") for outcome in outcomes]

    def _summarise(self, keys: Iterable[str]) -> None:
        for key in keys:
            write_summary(self.runs[key], self._finished.pop(key, {}))


def manifest_of(run: RunDirectory, config_json: bytes) -> dict[str, Any]:
    """Return the manifest of a run to create.

    Where it is lost, the first whole log tells the environment, and nothing the state of the code.
    """
    if not (run.path / identity.MANIFEST).exists():
        for _, log in identity.whole_logs(run.path, run.condition_id):
            return {"condition": run.condition_id, **log.environment, "git": None}
    return manifest(run.condition_id, guests(config_json))
