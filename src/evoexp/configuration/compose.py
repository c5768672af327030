"""From overrides to conditions; the only file that knows Hydra.

One function expands an experiment for every command. Whatever is wrong with a configuration is
found here, before anything is computed, and said in one line. Hydra reads overrides and composes
the chosen options; settings are assigned to copies of these (see `assignment`).
"""

import copy
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import hydra
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import OverrideType, ValueType
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from evoexp import shipped
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.configuration.assignment import assign_all
from evoexp.configuration.building import build_condition, build_settings, planned_replicates
from evoexp.configuration.experiment import Budget, Experiment, Labelled
from evoexp.configuration.interpolations import MARK, NotWhole, fill_in, refuse_functions
from evoexp.configuration.option_files import check_file, check_files
from evoexp.configuration.overrides import (
    ADD,
    DELETE,
    FORCE,
    JOIN,
    NOT_IDENTITY,
    SCALARS,
    Choice,
    Override,
    Value,
    collect,
    dotted,
    expand_entry,
    refuse_sweeps,
    single_values,
    sweep,
)
from evoexp.configuration.problem_folders import FOLDER, problem_choices
from evoexp.configuration.refusals import (
    uncomposed,
    unparsed,
    unresolved,
    without_header,
)
from evoexp.configuration.search_path import (
    EXPERIMENT,
    find,
    folders,
    groups,
    is_file,
)
from evoexp.errors import SettingError, UnknownOption, UnknownSetting
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import Option

_PREFIXES = {OverrideType.ADD: ADD, OverrideType.FORCE_ADD: FORCE, OverrideType.DEL: DELETE}
_SWEEPS = (ValueType.SIMPLE_CHOICE_SWEEP, ValueType.CHOICE_SWEEP, ValueType.RANGE_SWEEP)
_COMPOSER = (HydraException, OmegaConfBaseException, yaml.YAMLError, ValueError, TypeError, OSError)


class Composed(NamedTuple):
    """Chosen options, composed.

    Attributes:
        config: Their settings as plain data, interpolations as they are written.
        options: The option taken of each group.
    """

    config: dict[str, Any]
    options: tuple[Option, ...]


def expand(
    overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> list[Experiment]:
    """Expand overrides into experiments, one per `experiment=` swept over.

    Args:
        overrides: As typed: `experiment=rana_planar ga.population_size=20`; their order does not
            matter.
        multirun: Whether values with commas are swept over.
        only: Labels to keep; empty keeps all.

    Raises:
        EvoexpError: For whatever cannot be run; nothing has been computed then.
    """
    given = collect(map(parse, overrides))
    refuse_sweeps(given, multirun=multirun)
    asked = given.pop(EXPERIMENT, None)
    names = [each.option() for each in single_values(asked)] if asked else [None]
    files = [None if name is None else find(EXPERIMENT, name) for name in names]
    if len({file and file.name for file in files}) < len(files):
        raise SettingError(EXPERIMENT, "names that differ", ",".join(map(str, names)))
    with tempfile.TemporaryDirectory() as root:
        compose = _Composer(Path(root))
        return [_expand_one(file, given, only, compose) for file in files]


def parse(text: str) -> Override:
    """Read one override.

    Raises:
        SettingError: If it is none.
    """
    key, _, typed = text.partition("=")
    if key == EXPERIMENT and is_file(typed) and os.path.isfile(typed):  # whatever its name
        return Override("", key, (Value(typed, typed),), False, text)
    parser = OverridesParser.create()
    try:
        found = parser.parse_override(dotted(text))
        key, texts = found.key_or_group, [text.partition("=")[2]]
        if not key or found.package is not None:
            raise SettingError("override", "key=value", text)
        if found.is_sweep_override():
            if found.value_type not in _SWEEPS:
                must = "values that can be enumerated: a,b,c or range(…)"
                raise SettingError(key, must, texts[0])
            texts = list(found.sweep_string_iterator())
        data: list[Any] = [parser.parse_override(f"{key}={each}").value() for each in texts]
    except (HydraException, ValueError, RecursionError):
        raise unparsed(text) from None
    is_bare = found.value_type is None  # a deletion
    values = () if is_bare else tuple(map(Value, texts, map(_with_text_keys, data)))
    return Override(_PREFIXES.get(found.type, ""), key, values, found.is_sweep_override(), text)


def _with_text_keys(value: Any) -> Any:
    """Return a value with text for every key of its mappings."""
    if isinstance(value, dict):
        return {str(key): _with_text_keys(item) for key, item in value.items()}
    return [_with_text_keys(item) for item in value] if isinstance(value, list) else value


class _Composer:
    """Composes configurations of one expansion; Hydra composes every choice of options once.

    Hydra applies settings, too, but takes a tenth of a second and more each time, and reaches no
    setting in a list.
    """

    def __init__(self, root: Path) -> None:
        """Begin with the shipped root configuration.

        Args:
            root: An empty folder. It comes first in the search path and holds, beside the root,
                experiments that are given as files: of a user's folders only the options count.
        """
        self._root = root
        self._known: dict[tuple[str, ...], Composed] = {}
        shutil.copy(shipped.config_directory() / "config.yaml", root)
        (root / EXPERIMENT).mkdir()
        for folder in folders():
            if folder.origin != shipped.ORIGIN:
                check_files(folder.path)
        self._path = ",".join(_quoted(f"file://{folder.path}") for folder in folders())

    def __call__(self, overrides: Choice, file: Option | None) -> Composed:
        """Return the options that overrides choose, with the settings that overrides change.

        Args:
            overrides: By key, each with one value.
            file: The experiment.

        Raises:
            EvoexpError: If they cannot be composed.
        """
        choices = {key: overrides[key] for key in sorted(overrides) if key in groups()}
        base = self._chosen(choices, file)
        config = copy.deepcopy(base.config)
        assign_all(config, {key: each for key, each in overrides.items() if key not in choices})
        return Composed(config, base.options)

    def _chosen(self, choices: Choice, file: Option | None) -> Composed:
        words = [_choosing(override) for override in choices.values()]
        names = {group: override.option() for group, override in choices.items()}
        if file is not None:
            words.append(f"{EXPERIMENT}={_quoted(file.name)}")
            names[EXPERIMENT] = file.origin if is_file(file.origin) else file.name
        key = tuple(words)
        if key not in self._known:
            if file is not None and is_file(file.origin):
                check_file(Path(file.path))
                shutil.copy(file.path, self._root / EXPERIMENT / f"{file.name}.yaml")
            try:
                self._known[key] = self._by_hydra(words, file)
            except _COMPOSER as error:
                raise uncomposed(error, names, file) from None
        return self._known[key]

    def _by_hydra(self, words: list[str], file: Option | None) -> Composed:
        words = [*words, f"hydra.searchpath=[{self._path}]"]
        with hydra.initialize_config_dir(str(self._root), version_base="1.3"):
            composed = hydra.compose("config", overrides=words, return_hydra_config=True)
        taken = composed.hydra.runtime.choices
        config: Any = OmegaConf.to_container(composed, resolve=False)
        del config["hydra"]
        if config.get(EXPERIMENT) is not None:
            raise without_header(taken[EXPERIMENT])
        if unknown := config.keys() - {*groups(), *SCALARS, "conditions"}:
            raise UnknownSetting(min(map(str, unknown)), [*groups(), *SCALARS, "conditions"])
        for group in groups():
            if not isinstance(config.get(group, {}), dict):
                raise SettingError(group, "a mapping of settings", config[group])
        named = ((group, taken.get(group)) for group in groups() if group != EXPERIMENT)
        options = tuple(find(group, name) for group, name in named if name)
        return Composed(config, options if file is None else (file, *options))


def _choosing(override: Override) -> str:
    """Return the override of a group as Hydra takes it."""
    if (name := override.option()) is not None:
        return f"{override.key}={_quoted(name)}"
    if override.prefix == DELETE and override.values:  # only that option is to be deleted
        return f"~{override.key}={_quoted(str(override.values[0].data))}"
    return f"~{override.key}"


def _quoted(text: str) -> str:
    """Return a text as Hydra's grammar takes it, whatever is in it."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _expand_one(
    file: Option | None, overrides: Choice, only: Sequence[str], compose: _Composer
) -> Experiment:
    name = file.name if file else "custom"
    base, labelled = _labelled(name, overrides, only, compose, file)
    budget = build_settings(Budget, base["budget"], "budget")
    found = {label: compose(choice, file) for label, choice in labelled.items()}
    conditions = tuple(
        Labelled(label, _condition(composed.config, budget)) for label, composed in found.items()
    )
    return Experiment(
        name,
        budget.name,
        conditions,
        planned_replicates(base["num_replicates"], budget),
        build_settings(RunnerSettings, base["runner"], "runner"),
        build_settings(ReportSettings, base["report"], "report"),
        _changed(file, overrides, only, conditions, compose),
        {label: composed.options for label, composed in found.items()},
    )


def _changed(
    file: Option | None,
    overrides: Choice,
    only: Sequence[str],
    conditions: tuple[Labelled, ...],
    compose: _Composer,
) -> bool:
    """Whether the conditions differ from those that the experiment has by itself."""
    plain = {key: each for key, each in overrides.items() if key in NOT_IDENTITY}
    if file is None or (len(plain) == len(overrides) and not only):
        return file is None
    base, labelled = _labelled(file.name, plain, (), compose, file)
    if list(labelled) != [label for label, _ in conditions]:
        return True
    budget = build_settings(Budget, base["budget"], "budget")
    return any(
        _condition(compose(labelled[label], file).config, budget).id != condition.id
        for label, condition in conditions
    )


def _labelled(
    name: str, overrides: Choice, only: Sequence[str], compose: _Composer, file: Option | None
) -> tuple[dict[str, Any], dict[str, Choice]]:
    """Return the settings that all conditions share, and the overrides of each label."""
    swept = list(sweep(overrides))
    first = {key: each for key, each in swept[0][1].items() if key != FOLDER}
    base = _shared(compose(first, file).config)
    labels: dict[str, Choice] = {}
    owner: dict[str, str] = {}  # the file's own label of a condition that is swept over
    for template, entry in _entries(base["conditions"]):
        for label, own in expand_entry(template, map(parse, entry)):
            for suffix, chosen_here in swept:
                # the command line wins
                for problem, choice in problem_choices(own | chosen_here):
                    parts = (label, suffix, problem)
                    joined = JOIN.join(part for part in parts if part) or name
                    if not joined.isprintable():
                        raise SettingError("conditions", "labels of printable characters", joined)
                    if joined in labels:
                        raise SettingError("conditions", "labels that differ", joined)
                    labels[joined], owner[joined] = choice, label
    if unknown := [label for label in only if label not in {*labels, *owner.values()}]:
        raise UnknownOption("--only", unknown[0], labels)
    return base, {
        label: choice
        for label, choice in labels.items()
        if not only or {label, owner[label]} & set(only)
    }


def _entries(conditions: Any) -> Iterator[tuple[str, list[str]]]:
    """Yield label and overrides of the entries of `conditions`; without any, one that is empty."""
    if not isinstance(conditions, dict | None):
        raise SettingError("conditions", "a mapping of labels to lists of overrides", conditions)
    for template, entry in (conditions or {"": []}).items():
        if not isinstance(entry, list) or not all(isinstance(text, str) for text in entry):
            raise SettingError(f"conditions.{template}", "a list of overrides", entry)
        yield str(template), entry


def _condition(config: dict[str, Any], budget: Budget) -> Condition:
    """Build one composed configuration, its generations and queries capped by the budget."""
    plain, cap = _resolved(config), budget.max_generations
    asked = (plain.get("ga") or {}).get("num_generations")
    if cap is not None and isinstance(asked, int) and asked > cap:  # before a planner takes it in
        plain = _resolved(config | {"ga": config["ga"] | {"num_generations": cap}})
    built = build_condition(plain, str(config["planner"]))
    return built._replace(max_collision_queries=budget.collision_queries)


def _shared(config: dict[str, Any]) -> dict[str, Any]:
    """Return settings outside the conditions; they may be taken from those of a condition."""
    shared = {name: config[name] for name in NOT_IDENTITY if name in config}
    shared = _resolved(config) if MARK in str(shared) else shared
    return shared | {"conditions": config["conditions"]}  # whose overrides are resolved when set


def _resolved(config: dict[str, Any]) -> dict[str, Any]:
    """Return settings as plain data with their interpolations filled in."""
    try:
        return fill_in(config)
    except NotWhole:
        refuse_functions(config)
    try:
        plain: Any = OmegaConf.to_container(OmegaConf.create(config), resolve=True)
    except (*_COMPOSER, RecursionError) as error:
        raise unresolved(error, config) from None
    return dict(plain)
