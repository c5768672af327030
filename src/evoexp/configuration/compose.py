"""From overrides to conditions; the only file that knows Hydra.

One function expands an experiment for every command. Whatever is wrong with a configuration is
found here, before anything is computed, and said in one line. Hydra reads overrides and composes
the chosen options; settings are assigned to copies of these (see `overrides`).
"""

import contextlib
import importlib.util
import itertools
import math
import os
import re
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import hydra
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import OverrideType, ValueType
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from evoexp import shipped
from evoexp.attachments import file_content
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.configuration import overrides as syntax
from evoexp.configuration import search_path
from evoexp.configuration.building import build_settings, fill_in, planned_replicates
from evoexp.configuration.conditions import FOLDER, Builder, Composed, Entry, concerning
from evoexp.configuration.experiment import Budget, Built, Experiment
from evoexp.configuration.overrides import NOT_IDENTITY, SCALARS, SWEEP, Choice, Override, Span
from evoexp.configuration.search_path import EXPERIMENT, chosen, find, groups, is_file, options
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting, demand
from evoexp.input_files import MEGABYTE
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import Option

_PREFIXES = {
    OverrideType.ADD: syntax.ADD,
    OverrideType.FORCE_ADD: syntax.FORCE,
    OverrideType.DEL: syntax.DELETE,
}
_SWEEPS = (ValueType.SIMPLE_CHOICE_SWEEP, ValueType.CHOICE_SWEEP, ValueType.RANGE_SWEEP)
# parts of an entry of `conditions`, with what each is where it is left out
PARTS: dict[str, Any] = {"overrides": [], "readings": {}, "beside": {}}
# how Hydra would run a job, which takes a fifth of the time to compose
_JOB = ("launcher", "sweeper", "output", "help", "hydra_help", "hydra_logging", "job_logging")
_NO_JOB = [f"~hydra/{group}" for group in _JOB]
_COMPOSER = (HydraException, OmegaConfBaseException, yaml.YAMLError, ValueError, TypeError, OSError)
HEADER = "# @package _global_"  # first line of an experiment file
# of an option file, no larger, unfolded, than a person would write
MAX_FILE = MEGABYTE  # the largest shipped option has 9 kB
MOST_NESTED = 50  # lists and mappings in each other
MOST_VALUES = 100_000  # once every alias (`*name`) stands for a copy of what it names


def expand(
    overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> list[Experiment]:
    """Expand overrides, as typed in any order, into experiments, one per `experiment=` swept over.

    Args:
        multirun: Whether values with commas are swept over.
        only: Labels to keep; empty keeps all.
    """
    given = syntax.collect(map(parse, overrides))
    space = syntax.search_space(given)
    rest = {key: each for key, each in given.items() if key not in space}
    syntax.refuse_sweeps(rest, multirun=multirun or bool(space))
    asked = rest.pop(EXPERIMENT, None)
    names = [each.option() for each in syntax.single_values(asked)] if asked else [None]
    files = [None if name is None else find(EXPERIMENT, name) for name in names]
    differ = len({file and file.name for file in files}) == len(files)
    demand(differ, EXPERIMENT, "names that differ", ",".join(map(str, names)))
    return [_expand_one(file, rest, only, space) for file in files]


def parse(text: str) -> Override:
    """Read one override."""
    key, equals, typed = text.partition("=")
    if key == EXPERIMENT and is_file(typed) and os.path.isfile(typed):  # whatever its name
        return Override("", key, (syntax.Value(typed, typed),), False, text)
    parser = OverridesParser.create()
    try:
        indexed = re.sub(r"\[(\d+)\]", r".\1", key)  # `a[0]` is `a.0`
        found = parser.parse_override(f"{indexed}{equals}{typed}")
        key, texts = found.key_or_group, [typed]
        demand(key and found.package is None, "override", "key=value", text)
        span = None
        if found.is_interval_sweep():
            span = _span(key, found.value(), typed)
            texts = [str(span.low), str(span.high)]
        elif found.is_sweep_override():
            must = "values that can be enumerated: a,b,c or range(…)"
            demand(found.value_type in _SWEEPS, key, must, texts[0])
            texts = list(found.sweep_string_iterator())
        data: list[Any] = [parser.parse_override(f"{key}={each}").value() for each in texts]
    except (HydraException, ValueError, RecursionError):
        raise unparsed(text) from None
    is_bare = found.value_type is None  # a deletion
    values = () if is_bare else tuple(map(syntax.Value, texts, map(_with_text_keys, data)))
    if found.is_range_sweep() and len(values) > 1:
        numbers = [value.data for value in values]  # in any order
        sweep: Any = found.value()
        span = Span(min(numbers), max(numbers), abs(sweep.step), is_interval=False)
    prefix = _PREFIXES.get(found.type, "")
    return Override(prefix, key, values, found.is_sweep_override(), text, span)


def _span(key: str, interval: Any, typed: str) -> Span:
    low, high, is_log = interval.start, interval.end, "log" in interval.tags
    is_plain = key not in groups() and interval.tags <= {"log"}
    is_span = is_plain and -math.inf < low < high < math.inf and (low > 0 or not is_log)
    must = "a setting's interval(low,high) with low < high (in tag(log,…) both above 0)"
    demand(is_span, key, must, typed)
    return Span(low, high, 1 if isinstance(low, int) else None, is_log)


def _with_text_keys(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _with_text_keys(item) for key, item in value.items()}
    return [_with_text_keys(item) for item in value] if isinstance(value, list) else value


class Composer:
    """Composes configurations of one experiment; Hydra composes every choice of options once.

    Hydra could apply settings, too, but takes a tenth of a second, and reaches none in a list.
    """

    def __init__(self, file: Option | None) -> None:
        """Begin with the root configuration, in an empty folder that is searched first.

        Of a user's folders only the options count.
        """
        root = Path(tempfile.mkdtemp())
        weakref.finalize(self, shutil.rmtree, root, ignore_errors=True)
        self.root, self.file = root, file
        self._known: dict[frozenset[str], Composed] = {}  # by the words that choose options
        shutil.copy(shipped.config_directory() / "config.yaml", root)
        (root / EXPERIMENT).mkdir()
        for folder in search_path.folders():
            if folder.origin != shipped.ORIGIN:
                for path in sorted(folder.path.glob("*/*.yaml")):
                    check_file(path)
        self._path = ",".join(_quoted(f"file://{folder.path}") for folder in search_path.folders())

    def chosen(self, overrides: Choice) -> Composed:
        """Return the options that overrides choose, with the settings that these have."""
        file = self.file
        choices = {key: overrides[key] for key in sorted(overrides) if key in groups()}
        names = {group: override.option() for group, override in choices.items()}
        words = []
        for group, override in choices.items():
            option = names[group]
            if option is None and override.prefix == syntax.DELETE and override.values:
                option = str(override.values[0].data)  # only that option is to be deleted
            chosen = "" if option is None else f"={_quoted(option)}"
            words.append(f"{'~' if names[group] is None else ''}{group}{chosen}")
        if file is not None:
            names[EXPERIMENT] = file.origin if is_file(file.origin) else file.name
        if (key := frozenset(words)) not in self._known:
            if file is not None and is_file(file.origin):
                check_file(Path(file.path))
                shutil.copy(file.path, self.root / EXPERIMENT / f"{file.name}.yaml")
            try:
                self._known[key] = self.by_hydra(words)
            except _COMPOSER as error:
                raise uncomposed(error, names, file) from None
        return self._known[key]

    def by_hydra(self, words: list[str]) -> Composed:
        """Have Hydra compose options, chosen by words of its own grammar."""
        if self.file is not None:
            words = [*words, f"{EXPERIMENT}={_quoted(self.file.name)}"]
        words = [*words, *_NO_JOB, f"hydra.searchpath=[{self._path}]"]
        with hydra.initialize_config_dir(str(self.root), version_base="1.3"):
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
        return Composed(config, options if self.file is None else (self.file, *options))


def _quoted(text: str) -> str:
    """Return a text as Hydra's grammar takes it, whatever is in it."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _expand_one(
    file: Option | None, overrides: Choice, only: Sequence[str], space: Choice
) -> Experiment:
    compose = Composer(file)
    base, builder = _builder(compose, overrides)
    built = builder.build_all(overrides, only)
    experiment = Experiment(
        builder.name,
        builder.budget.name,
        planned_replicates(base["num_replicates"], builder.budget),
        build_settings(RunnerSettings, base["runner"], "runner"),
        build_settings(ReportSettings, base["report"], "report"),
        _is_changed(compose, overrides, only, built),
    ).of(built)
    if not space:
        return experiment
    must = "left out: optuna needs pip install 'evoexp[tuning]'"
    demand(importlib.util.find_spec("optuna"), SWEEP, must, "optuna")
    from evoexp.configuration.setting_search import SearchSettings, with_search  # pandas

    settings = build_settings(SearchSettings, base[SWEEP], SWEEP)
    return with_search(
        experiment, settings, space, lambda chosen: builder.build_all({**overrides, **chosen}, only)
    )


def _builder(compose: Composer, overrides: Choice) -> tuple[dict[str, Any], Builder]:
    first = {key: each for key, each in next(syntax.sweep(overrides)).items() if key != FOLDER}
    shared_choice = concerning(first, compose.chosen(first).config)
    config = syntax.assigned(compose.chosen(shared_choice).config, shared_choice)
    # settings outside the conditions may be taken from those of a condition
    shared = {name: config[name] for name in NOT_IDENTITY if name in config}
    base = fill_in(shared, config)
    budget = build_settings(Budget, base["budget"], "budget")
    name = compose.file.name if compose.file else "custom"
    return base, Builder(name, list(_entries(config["conditions"])), compose.chosen, budget)


def _is_changed(
    compose: Composer, overrides: Choice, only: Sequence[str], built: Mapping[str, Built]
) -> bool:
    """Whether the conditions differ from the experiment's own."""
    plain = {key: each for key, each in overrides.items() if key in NOT_IDENTITY}
    if compose.file is None or (len(plain) == len(overrides) and not only):
        return compose.file is None
    with contextlib.suppress(EvoexpError):  # a file that the experiment names need not be there
        own = _builder(compose, plain)[1].build_all(plain, ())
        return [*own] != [*built] or any(own[k].condition.id != built[k].condition.id for k in own)
    return True


def _entries(conditions: Any) -> Iterator[Entry]:
    if not isinstance(conditions, dict | None):
        raise SettingError("conditions", "a mapping of labels to lists of overrides", conditions)
    for label, entry in (conditions or {"": []}).items():
        for template, overrides in readings(str(label), entry):
            yield from syntax.expand_entry(template, map(parse, overrides))


def readings(label: str, entry: Any) -> Iterator[tuple[str, list[str]]]:
    """Yield label and overrides of an entry under every reading, alone and beside the others.

    An entry is a list of overrides, or a mapping with `overrides`, `readings` and `beside`; the
    latter two are mappings of labels to lists of overrides.
    """
    field, must = f"conditions.{label}", "a list of overrides"
    parts = entry if isinstance(entry, dict) else {"overrides": entry}
    if unknown := [key for key in parts if key not in PARTS]:
        raise SettingError(f"{field}.{unknown[0]}", f"one of {', '.join(PARTS)}", parts[unknown[0]])
    own, readings, beside = (parts.get(part, default) for part, default in PARTS.items())
    for part, each in (("readings", readings), ("beside", beside)):
        demand(isinstance(each, dict), f"{field}.{part}", f"a mapping of labels to {must}s", each)
    for each in (own, *readings.values(), *beside.values()):
        are_words = isinstance(each, list) and all(isinstance(text, str) for text in each)
        demand(are_words, field, must, each)
    alone = {"": list[str]()}
    for first, second in itertools.product({**alone, **readings}, {**alone, **beside}):
        words = ", ".join(filter(None, (label, first, second)))
        yield words, [*own, *readings.get(first, ()), *beside.get(second, ())]


# errors of the composer, each turned into one line that names a field and a remedy


def unparsed(text: str) -> SettingError:
    """Return the refusal of an override that cannot be read."""
    key, equals, value = text.partition("=")
    if not equals or not re.fullmatch(r"[~+]*[A-Za-z_][\w.\[\]]*", key):
        return SettingError("override", "key=value", text)
    must = "a number, a word, a [list], a {mapping} or 'any text' in quotes"
    return SettingError(key.lstrip("+~"), must, value)


def uncomposed(
    error: Exception, choices: Mapping[str, str | None], file: Option | None
) -> EvoexpError:
    """Return the refusal of options (by group, as far as they were chosen) that do not compose."""
    text, cause = str(error), error
    while cause.__cause__ is not None and not isinstance(cause, yaml.MarkedYAMLError):
        cause = cause.__cause__  # type: ignore[assignment]
    if isinstance(cause, yaml.MarkedYAMLError) and (mark := cause.problem_mark) is not None:
        must = f"a YAML file (line {mark.line + 1}: {cause.problem})"
        return SettingError(EXPERIMENT, must, mark.name)
    if file is not None and (refusal := _miswritten(file)) is not None:
        return refusal
    if missing := re.search(r"You must specify '([^']+)'", text):
        group = missing[1]
        if not choices.get(EXPERIMENT):
            must = f"{chosen(EXPERIMENT)} (without one, every group is needed; the next is {group})"
            return SettingError(EXPERIMENT, must, None)
        return SettingError(group, chosen(group), None)
    if absent := re.search(r"Could not find '([^'/]+)/([^']+)'", text):
        return UnknownOption(absent[1], absent[2], options(absent[1]))
    if deleted := re.search(r"Could not delete '(([^=']+).*)'\.", text):
        return SettingError(deleted[2], "an option that is chosen, to be deleted", f"~{deleted[1]}")
    files = {group: name for group, name in choices.items() if name}
    group = EXPERIMENT if EXPERIMENT in files else next(iter(files), EXPERIMENT)
    reason = next(iter(text.strip().splitlines()), type(error).__name__)
    must = f"an option whose file can be composed ({reason})"
    return SettingError(group, must, files.get(group))


def without_header(file: str) -> SettingError:
    """Return the refusal of an experiment whose settings would not reach the configuration."""
    return SettingError(EXPERIMENT, f"a file that begins with '{HEADER}'", file)


def _miswritten(file: Option) -> EvoexpError | None:
    content = Path(file.path).read_bytes()
    if HEADER.encode() not in content.splitlines()[:1]:
        return without_header(file.origin)
    plain: Any = yaml.safe_load(content)
    defaults = plain.get("defaults", []) if isinstance(plain, dict) else None
    if not isinstance(defaults, list):
        must = "a file of settings whose 'defaults' are a list of options"
        return SettingError(EXPERIMENT, must, file.origin)
    for entry in defaults:
        for key, name in entry.items() if isinstance(entry, dict) else ():
            group = str(key).removeprefix("override ").lstrip("/")
            if str(key).startswith("override ") and group not in groups():
                return UnknownOption("group", group, groups())
            if group in groups() and name is not None and str(name) not in options(group):
                return UnknownOption(group, str(name), options(group))
    return None


def check_file(path: Path) -> None:
    """Refuse an option file that is too large, or that unfolds to too many values."""
    content = file_content(path, "option", MAX_FILE)
    try:
        unfolded = _num_values(yaml.parse(content, yaml.CSafeLoader))
    except (yaml.YAMLError, ValueError, RecursionError):
        return  # told by whoever reads it, if anybody does
    must = f"a file of at most {MOST_VALUES:,} values, aliases unfolded, {MOST_NESTED} deep"
    demand(unfolded <= MOST_VALUES, "option", must, str(path))


def _num_values(events: Iterator[yaml.Event]) -> int:
    """Return how many values there are, aliases unfolded; very many if they are nested deeply."""
    sizes: dict[str, int] = {}  # of what has a name
    total, open_nodes = 0, list[tuple[str | None, int]]()  # (name, values before it)
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            total += sizes.get(event.anchor, MOST_VALUES)  # what is open yet would hold itself
        elif isinstance(event, yaml.CollectionStartEvent):
            open_nodes.append((event.anchor, total))
            if len(open_nodes) > MOST_NESTED:
                return MOST_VALUES + 1
            total += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            name, before = open_nodes.pop()
            if name is not None:
                sizes[name] = total - before
        elif isinstance(event, yaml.ScalarEvent):
            total += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
    return total
