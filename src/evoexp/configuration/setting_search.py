"""Searches of settings, `sweep=optuna`: Optuna proposes values, trial by trial (ask and tell).

A swept setting of planner, operators or control is searched; what describes the problem is crossed
as in any sweep. The study lies beside the runs, `searches/<report>/journal.log`, and is resumed by
the same command. A proposal depends on the finished trials and the seed alone: an interrupted
search goes on as an undisturbed one.
"""

import contextlib
import functools
import hashlib
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import optuna
from filelock import FileLock, Timeout
from optuna.storages.journal import JournalFileBackend, JournalStorage
from optuna.trial import TrialState

from evoexp.configuration.experiment import Built, Experiment
from evoexp.configuration.overrides import SWEEP, Choice, Override, Value
from evoexp.errors import Busy, EvoexpError, SettingError, StoreError, brief
from evoexp.report.pages.sweeps import Searched, Trial, score_table
from evoexp.report.results.stored_results import gather
from evoexp.store.run_directory import outputs_root
from evoexp.validation import Count, NonNegativeCount, Positive, Settings

DIGITS = 4  # of a number that is proposed: as many as one types
REPEATS = 10  # proposals that are known, after which one of the unknown ones is drawn
REFUSED = "refused"  # attribute of a trial whose settings do not go together: why
FEWEST = 10  # trials from which on the importance of settings is told
BEST = 5  # trials that are told from all others for it, a tenth of many (Optuna's advice)

optuna.logging.set_verbosity(optuna.logging.WARNING)  # each trial has its line


class SearchSettings(Settings):
    """Settings of `conf/sweep`."""

    num_trials: Count  # beside the experiment as it is; those already finished count
    sampler: Literal["tpe", "random"]  # of Optuna
    unsolved: Positive  # score of a run without a proven answer, see `score_table`
    seed: NonNegativeCount  # of the sampler


class Asked(NamedTuple):
    """A trial that Optuna asks for."""

    trial: Trial
    conditions: dict[str, Built]  # by label; none if it is refused
    study_number: int  # which counts interrupted trials, too
    refusal: str = ""  # why its settings do not go together


class Search:
    """A search of the settings of one experiment.

    `base` are the experiment's own conditions, by label, as far as the searched settings change
    them: the problems.
    """

    def __init__(
        self,
        settings: SearchSettings,
        space: Choice,
        num_replicates: int,
        folder: Path,
        build: Callable[[Choice], dict[str, Built]],
    ) -> None:
        """Try the ends and a middle of every setting; the study need not be there.

        Each must go with the experiment as it is, or with a value of another searched setting.

        Args:
            settings: How to search.
            space: Searched overrides by key, each with its values or its span.
            num_replicates: Replicates of every condition.
            folder: Where the study lies.
            build: Returns conditions by label, those of the same problems in the same order, of
                overrides that are added.

        Raises:
            EvoexpError: If a value is refused.
        """
        self.settings, self.space, self.folder = settings, space, folder
        self.journal = folder / "journal.log"
        self.num_replicates, self._build = num_replicates, build
        own = build({})
        self._num_conditions = len(own)
        probes = [(key, value) for key, override in space.items() for value in _probes(override)]
        rows = list(filter(None, (self._probed(*each, probes) for each in probes)))
        self._changed = [
            k
            for k, each in enumerate(built.condition for built in own.values())
            if not each.is_reference and any(row[k] != each.id for row in rows)
        ]
        if not self._changed:
            raise SettingError(SWEEP, "beside values that change a condition", " ".join(space))
        self.base = self._problems(own)
        self.first = Trial(0, {}, _ids(self.base))

    def _probed(self, key: str, value: Value, probes: list[tuple[str, Value]]) -> tuple[str, ...]:
        """Return the conditions of a value; none if it goes only with one of another setting."""
        try:
            return _ids(self._built({key: value}))
        except SettingError as error:
            for other, its in probes:
                with contextlib.suppress(EvoexpError):
                    if other != key and self._built({key: value, other: its}):
                        return ()
            override, hint = self.space[key], error.hint
            if "whole" in error.must and override.span and override.span.step is None:
                hint = f"; write int({override.typed})"
            raise SettingError(error.field, error.must, error.was, hint) from None

    def _built(self, values: Mapping[str, Value]) -> dict[str, Built]:
        """Return all conditions under values of some settings."""
        choice = {
            key: self.space[key]._replace(values=(value,), span=None, text=f"{key}={value.text}")
            for key, value in values.items()
        }
        built = self._build(choice)
        if len(built) != self._num_conditions:
            must = "a setting in which the conditions of the experiment do not differ (see --only)"
            raise SettingError(next(iter(values)), must, ", ".join(v.text for v in values.values()))
        return built

    def _trial(self, number: int, params: Mapping[str, Any]) -> tuple[Trial, dict[str, Built]]:
        """Return a trial, `number` among the finished ones, and its conditions by label."""
        values = {key: _value(override, params[key]) for key, override in self.space.items()}
        built = self._problems(self._built(values))
        return Trial(number, self._texts(params), _ids(built)), built

    def _problems(self, conditions: dict[str, Built]) -> dict[str, Built]:
        """Return the conditions that the searched settings change."""
        return {key: each for k, (key, each) in enumerate(conditions.items()) if k in self._changed}

    def _texts(self, params: Mapping[str, Any]) -> dict[str, str]:
        return {key: _value(each, params[key]).text for key, each in self.space.items()}

    @functools.cached_property
    def study(self) -> Any:
        """The study as it is stored; None if there is none."""
        return self._opened(optuna.load_study) if self.journal.exists() else None

    def _opened(self, study: Callable[..., Any], **how: bool) -> Any:
        try:
            storage = JournalStorage(JournalFileBackend(str(self.journal)))
            return study(storage=storage, study_name=self.folder.name, **how)
        except KeyError:  # the journal has no whole line
            return None
        except (ValueError, LookupError, TypeError, AssertionError) as error:
            remedy = "delete it: the same trials are proposed again, their runs are kept"
            reason = brief(str(error), 80)
            raise StoreError(f"{self.journal}: is damaged ({reason}); {remedy}") from None

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the study for writing; trials that an earlier process did not finish are given up.

        `Busy` is raised where another process holds it.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            with FileLock(self.folder / ".lock", timeout=0):
                if self.journal.exists():  # cut off a line that a process did not finish writing
                    content = self.journal.read_bytes()
                    os.truncate(self.journal, content.rfind(b"\n") + 1)
                self.study = self._opened(optuna.create_study, load_if_exists=True)
                for trial in self.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
                    self.study.tell(trial.number, state=TrialState.FAIL)
                yield
        except Timeout:
            raise Busy(f"{self.folder}: another process goes on with this search now") from None

    @property
    def finished(self) -> list[Any]:
        """The trials of the study that have a score, or were refused."""
        states = TrialState.COMPLETE, TrialState.PRUNED
        return self.study.get_trials(deepcopy=False, states=states) if self.study else []

    def ask(self) -> Asked | None:
        """Return the next trial; None if all are finished, or no other combination is left.

        A refused one is finished at once. A proposal of known values is given up.
        """
        known = [self._texts(trial.params) for trial in self.finished]
        number = len(known) + 1
        choices: dict[str, Any] = {key: _choices(each) for key, each in self.space.items()}
        num_combinations = math.prod(map(len, choices.values()))  # 0: an interval of any numbers
        if number > self.settings.num_trials or 0 < num_combinations < number:
            return None
        for attempt in range(REPEATS + 1):
            if attempt == REPEATS and num_combinations:  # one of the unknown combinations
                rng = np.random.default_rng((self.settings.seed, number))
                drawn = self.finished[0].params
                while self._texts(drawn) in known:
                    drawn = {key: each[rng.integers(len(each))] for key, each in choices.items()}
                self.study.enqueue_trial(drawn)
            self.study.sampler = self._sampler(number, attempt)
            trial = self.study.ask({key: _distribution(each) for key, each in self.space.items()})
            if self._texts(trial.params) not in known or attempt == REPEATS:
                break
            self.study.tell(trial, state=TrialState.FAIL)
        try:
            own, conditions = self._trial(number, trial.params)
            for built in conditions.values():
                built.condition.prepare()  # refuses what does not go together
        except EvoexpError as error:
            trial.set_user_attr(REFUSED, str(error))
            self.study.tell(trial, state=TrialState.PRUNED)
            return Asked(Trial(number, self._texts(trial.params), ()), {}, trial.number, str(error))
        return Asked(own, conditions, trial.number)

    def _sampler(self, *numbers: int) -> Any:
        """Return a sampler whose proposal depends on nothing but finished trials and numbers."""
        seed = int(np.random.SeedSequence((self.settings.seed, *numbers)).generate_state(1)[0])
        kinds = {"tpe": optuna.samplers.TPESampler, "random": optuna.samplers.RandomSampler}
        return kinds[self.settings.sampler](seed=seed)

    def score(self, asked: Asked | None = None) -> float:
        """Judge a trial that has been run and note its score; None: the experiment as it is."""
        trial, conditions = (asked.trial, asked.conditions) if asked else (self.first, {})
        labelled = [(k, built.condition) for k, built in [*self.base.items(), *conditions.items()]]
        found = gather(outputs_root(), labelled, self.num_replicates, self.folder.name, "", "")
        table = score_table(self._searched(*[trial] * bool(asked)), found.conditions)
        score = float(table.loc[table["trial"] == trial.number, "score"].mean())
        if asked:
            self.study.tell(asked.study_number, score)
        return score

    @property
    def scores(self) -> list[float]:
        """The scores of the finished trials that were not refused."""
        return [trial.value for trial in self.finished if trial.value is not None]

    @functools.cached_property
    def stored(self) -> list[tuple[Trial, dict[str, Built]]]:
        """The trials that were finished when this was first asked for, with their conditions."""
        finished = enumerate(self.finished, 1)
        return [self._trial(k, each.params) for k, each in finished if each.value is not None]

    @property
    def conditions(self) -> dict[str, Built]:
        """The conditions of the problems and of all stored trials by label, each once."""
        known = {built.condition.id: label for label, built in self.base.items()}
        return self.base | {
            label: built
            for _, conditions in self.stored
            for label, built in conditions.items()
            if known.setdefault(built.condition.id, label) == label
        }

    @property
    def best_conditions(self) -> dict[str, Built]:
        """The conditions of the problems and of the stored trial of the least score, by label."""
        return self.base | (self.stored[np.argmin(self.scores)][1] if self.stored else {})

    def found(self) -> Searched:
        """Return the trials found so far, with the importance of settings."""
        found = self._searched(*(trial for trial, _ in self.stored))
        refused = {
            " ".join(f"{key}={text}" for key, text in self._texts(trial.params).items()): reason
            for trial in self.finished
            if (reason := trial.user_attrs.get(REFUSED))
        }
        return found._replace(refused=refused, importance=self._importance(), told=(*self.scores,))

    def _searched(self, *trials: Trial) -> Searched:
        shared = self.num_replicates, self.settings.unsolved
        return Searched(tuple(self.base), (self.first, *trials), *shared)

    def _importance(self) -> dict[str, float]:
        """Return the importance of each setting for being among the best trials (PED-ANOVA)."""
        scores = sorted(self.scores)
        num_best = max(BEST, len(scores) // 10)
        if len(scores) < FEWEST or len(self.space) < 2 or scores[num_best - 1] == scores[-1]:
            return {}
        best = num_best / len(scores)
        evaluator = optuna.importance.PedAnovaImportanceEvaluator(target_quantile=best)
        return dict(optuna.importance.get_param_importances(self.study, evaluator=evaluator))


def with_search(
    experiment: Experiment,
    settings: SearchSettings,
    space: Choice,
    build: Callable[[Choice], dict[str, Built]],
) -> Experiment:
    """Return an experiment whose conditions are the finished trials of a search, see `Search`."""
    space = dict(sorted(space.items()))  # whatever the order in which it was typed
    words = [override.text for override in space.values()]
    own = [condition.id for _, condition in experiment.conditions]
    # whatever a proposal or a score depends on
    about = [words, own, experiment.num_replicates, settings.model_dump(exclude={"num_trials"})]
    plain = experiment._replace(changed=False).report_name
    name = f"{plain}+{hashlib.sha256(repr(about).encode()).hexdigest()[:8]}"
    folder = outputs_root() / "searches" / name
    search = Search(settings, space, experiment.num_replicates, folder, build)
    return experiment.of(search.conditions)._replace(search=search)


def _ids(conditions: Mapping[str, Built]) -> tuple[str, ...]:
    return tuple(built.condition.id for built in conditions.values())


def _distribution(override: Override) -> Any:
    distributions: Any = optuna.distributions
    span = override.span
    if span is None:
        return distributions.CategoricalDistribution([value.text for value in override.values])
    ends: dict[str, Any] = {"low": span.low, "high": span.high, "log": span.is_log}
    if isinstance(span.low, int):
        return distributions.IntDistribution(**ends, step=span.step)
    return distributions.FloatDistribution(**ends, step=span.step)


def _choices(override: Override) -> Sequence[Any]:
    """Return all that Optuna may propose of a setting; nothing: any number of an interval."""
    span = override.span
    if span is not None and span.is_interval:
        return range(span.low, int(span.high) + 1) if isinstance(span.low, int) else ()
    return [value.data if span else value.text for value in override.values]


def _value(override: Override, proposed: Any) -> Value:
    """Return a proposed value as one would type it."""
    if override.span is None:
        return next(value for value in override.values if value.text == proposed)
    if isinstance(proposed, int):
        return Value(str(proposed), proposed)
    if not override.span.is_interval:
        return min(override.values, key=lambda value: abs(value.data - proposed))
    rounded = float(f"{proposed:.{DIGITS}g}")
    number = min(max(rounded, override.span.low), override.span.high)
    return Value(f"{number:.12g}", number)


def _probes(override: Override) -> Iterator[Value]:
    """Yield values of a setting: all that are listed, or the ends and a middle of a span."""
    yield from override.values
    if (span := override.span) is not None and span.is_interval:
        middle = math.sqrt(span.low * span.high) if span.is_log else (span.low + span.high) / 2.0
        yield _value(override, int(middle) if isinstance(span.low, int) else middle)
