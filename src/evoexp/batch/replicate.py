"""The one loop: a planner yields generations, a log takes them, the certifier judges the best."""

import contextlib
import functools
import hashlib
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from evoexp.attachments import SHA256
from evoexp.collision.box_support import EXACT
from evoexp.collision.certifier.certificate import Certificate
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.gathering import Run
from evoexp.planners.proofs import judge_motion
from evoexp.records import Generation, ReplicateSummary, Stretch
from evoexp.registry import guests
from evoexp.store.log import Finished, Log
from evoexp.store.manifest import environment

GENERATIONS = "generations"  # why a run ended that used all of them up
BUDGET_SPENT = "collision queries"  # why a run ended whose next generation exceeds the budget
EXACT_BOXES = "exact_boxes"  # the entry of a log's environment; logs without it are older
HASHED = f'"{SHA256}"'.encode()  # stands in configurations that refer to files, and only there


class Times(NamedTuple):
    """Processor time and duration of something, or two readings of clocks."""

    cpu_s: float  # [s]
    wall_s: float  # [s]

    def __sub__(self, earlier: "Times") -> "Times":
        return Times(self.cpu_s - earlier.cpu_s, self.wall_s - earlier.wall_s)


def now() -> Times:
    """Return processor time and time of this process."""
    return Times(time.process_time(), time.perf_counter())


def run_replicate(
    condition: Condition,
    index: int,
    config_json: bytes | None = None,
    hear: Callable[[Generation], None] | None = None,
) -> Finished:
    """Run one seeded replicate; return its finished log as bytes and its summary row.

    Args:
        condition: What to run.
        index: Of the replicate.
        config_json: The condition's canonical form, if the caller has it; making it takes as long
            as a short run.
        hear: Told every generation, after the log was.
    """
    replicate = _Replicate(condition, index, config_json or condition.to_json(), hear)
    replicate.evolve()
    return replicate.end()


def run_together(
    condition: Condition, indices: Sequence[int], config_json: bytes
) -> list[Finished]:
    """Run several short replicates step by step; the same as one after the other.

    What is done once per replicate finds its code and data pushed out of the caches by the search.
    Done for several replicates in turn, it takes two thirds of the time. Where generations are
    recorded one by one, it is not put off: the next search may use the same memory.

    Args:
        condition: What to run.
        indices: Of the replicates.
        config_json: The condition's canonical form.
    """
    replicates = [_Replicate(condition, index, config_json, None) for index in indices]
    for each in replicates:
        each.evolve()
        if not each.waits:
            each.end()
    for step in (_Replicate.record, _Replicate.judge):
        for each in replicates:
            step(each)
    return [each.end() for each in replicates]


class _Replicate:
    """One replicate, step by step; only the time of its own steps is its own."""

    def __init__(
        self,
        condition: Condition,
        index: int,
        config_json: bytes,
        hear: Callable[[Generation], None] | None,
    ) -> None:
        self._condition, self._index, self._config_json = condition, index, config_json
        self._condition_id, self._hear = hashlib.sha256(config_json).hexdigest(), hear
        self._planner, self._problem = condition.prepare()  # kept: no part of a replicate's time
        self._waiting: Stretch | None = None  # the last one, which is not written yet
        self._verdict: Certificate | None = None
        self._finished: Finished | None = None
        self._cpu_s = self._wall_s = 0.0

    @contextlib.contextmanager
    def _timed(self) -> Iterator[Times]:
        """Add the time of the body to that of the replicate; give the time when it begins."""
        begun = now()
        yield begun
        taken = now() - begun
        self._cpu_s, self._wall_s = self._cpu_s + taken.cpu_s, self._wall_s + taken.wall_s

    def evolve(self) -> None:
        """Run the search; write all generations but the last ones that are recorded together."""
        with self._timed() as begun:
            self._rng = self._condition.rng(self._index)
            run = self._planner.evolve(self._problem, self._rng)
            most, hear = self._condition.max_collision_queries, self._hear
            if most is None and hear is None and isinstance(run, Run):
                self._evolved = self._log_together(run, begun.cpu_s)
            else:
                self._evolved = _log_each(run, self._log, begun.cpu_s, most, hear)

    @functools.cached_property
    def _log(self) -> Log:
        config_json = self._config_json
        files = self._condition.files() if HASHED in config_json else None
        around = environment(guests(config_json)) | {EXACT_BOXES: {"coal": EXACT}}
        return Log(self._condition_id, config_json, self._index, self._rng, files, around)

    def _log_together(self, run: Run, begun_s: float) -> "_Evolved":
        """Log generations many at a time; those of the last stretch wait."""
        first_feasible: int | None = None
        for stretch in run.stretches(lambda: time.process_time() - begun_s):
            if self._waiting is not None:
                self._log.write_stretch(self._waiting)
            self._waiting = stretch
            if first_feasible is None and any(stretch.num_feasible):
                feasible = (k for k, count in enumerate(stretch.num_feasible) if count > 0)
                first_feasible = stretch.first + next(feasible)
        self._waiting = stretch = stretch.copied()
        return _Evolved(stretch.last(), first_feasible, GENERATIONS)

    @property
    def waits(self) -> bool:
        """Whether generations wait: then nothing that is needed is in the planner's memory."""
        return self._waiting is not None

    def record(self) -> None:
        """Write the generations that wait."""
        if self._waiting is not None:
            with self._timed():
                self._log.write_stretch(self._waiting)
            self._waiting = None

    def judge(self) -> None:
        """Judge the best motion on exact geometry, once."""
        if self._verdict is None:
            before = self._cpu_s
            with self._timed():
                motion = self._planner.motion(self._problem, self._evolved.last.best)
                self._verdict = judge_motion(self._planner, self._problem, motion)
            self._certificate_s = self._cpu_s - before

    def end(self) -> Finished:
        """Take the steps that are left; return the closed log and the summary row."""
        if self._finished is None:
            self.record()
            self.judge()
            self._finished = self._log.finish(self._summary())
        return self._finished

    def _summary(self) -> ReplicateSummary:
        last, first_feasible, ended = self._evolved
        assert self._verdict is not None, "it is judged"
        with self._timed():
            terms = last.terms | self._planner.evaluate(self._problem, last.best)
        return ReplicateSummary(
            condition=self._condition_id,
            replicate=self._index,
            status="done",
            stop_reason=ended,
            num_generations=last.index,
            best_cost=last.best_cost,
            first_feasible_generation=first_feasible,
            evaluations=last.evaluations,
            collision_queries=last.collision_queries,
            solved=last.solved,
            **self._verdict._asdict(),
            length_unit=self._condition.length_unit,
            terms=terms,
            digest="",
            certificate_s=self._certificate_s,
            cpu_s=self._cpu_s,
            wall_s=self._wall_s,
        )


class _Evolved(NamedTuple):
    """Entries of a summary that all generations together give."""

    last: Generation
    first_feasible: int | None  # index of the first generation with a feasible individual
    stop_reason: str


def _log_each(
    generations: Iterator[Generation],
    log: Log,
    begun_s: float,
    most: float | None,
    hear: Callable[[Generation], None] | None,
) -> _Evolved:
    """Log generations one by one, up to the first that asks for more configurations than `most`."""
    first_feasible: int | None = None
    last: Generation | None = None
    ended = GENERATIONS
    for generation in generations:
        if most is not None and generation.collision_queries > most:
            ended = BUDGET_SPENT
            break
        last = generation
        log.write(last, time.process_time() - begun_s)  # the planner knows nothing of files
        if hear is not None:
            hear(last)
        if first_feasible is None and last.num_feasible > 0:
            first_feasible = last.index
    if last is None:
        raise _too_few(most, generation)
    return _Evolved(last, first_feasible, last.stop_reason or ended)


def _too_few(most: float | None, first: Generation) -> SettingError:
    must = f"at least what the initial population asks for ({first.collision_queries:,})"
    return SettingError("budget.collision_queries", must, most)
