"""From overrides to conditions; the only file that knows Hydra.

One function expands an experiment for every command. Whatever is wrong with a configuration is
found here, before anything is computed, and said in one line.
"""

import copy
import difflib
import itertools
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import hydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, OverrideType, ValueType
from hydra.errors import HydraException
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from pydantic import ValidationError

from evoexp import shipped
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import PARTS, Condition, read_files
from evoexp.configuration.experiment import Experiment, Labelled
from evoexp.configuration.search_path import file_directories, folders, groups, options
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting, nearest
from evoexp.registry import component_class
from evoexp.report.report_settings import ReportSettings
from evoexp.validation import TARGET, Count, Settings, build, settings_error

PLANNER_PARTS = (
    "ga",
    "objective",
    "collision",
)  # groups that a planner's option takes in by interpolation
AROUND = ("control", "reference")  # groups whose option is put around the chosen planner
JOIN = " · "

AnySettings = TypeVar("AnySettings", bound=Settings)


class Budget(Settings):
    """A cap on what an experiment may cost.

    Attributes:
        name: `paper` caps nothing.
        max_replicates: Cap on the number of replicates.
        max_generations: Cap on the number of generations; changes the condition.
    """

    name: str
    max_replicates: Count | None
    max_generations: Count | None


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
    parsed = _parse(overrides)
    for key, override in parsed.items():
        if override.is_sweep_override():
            if not multirun:
                raise SettingError(
                    key, "one value (or add -m to sweep over several)", _value(override)
                )
            if key != "experiment" and _root(key) in _NOT_IDENTITY:
                raise SettingError(
                    key, "one value: a sweep is over what changes a condition", _value(override)
                )
    chosen = parsed.pop("experiment", None)
    names = (
        [None if name == "null" else name for name in _choices(chosen)]
        if chosen is not None
        else [None]
    )
    if len(set(names)) < len(names):
        raise SettingError("experiment", "names that differ", ",".join(map(str, names)))
    with tempfile.TemporaryDirectory() as root:
        # Of a user's folders only the options count: the root configuration is always the shipped.
        shutil.copy(shipped.config_directory() / "config.yaml", root)
        with hydra.initialize_config_dir(root, version_base="1.3"):
            return [_expand_one(name, parsed, only) for name in names]


def _hydra(options: Sequence[str]) -> DictConfig:
    """Have Hydra compose a choice of options from all folders of the search path."""
    quoted = (
        "'file://" + str(folder.path).replace("\\", "\\\\").replace("'", "\\'") + "'"
        for folder in folders()
    )
    return hydra.compose("config", overrides=[*options, f"hydra.searchpath=[{','.join(quoted)}]"])


_NOT_IDENTITY = ("experiment", "budget", "num_replicates", "runner", "report")


def _expand_one(
    name: str | None, overrides: Mapping[str, Override], only: Sequence[str]
) -> Experiment:
    composed = _Composed()
    base, labelled = _labelled(name, overrides, only, composed)
    budget = _settings(Budget, base.budget, "budget")
    conditions = tuple(
        Labelled(label, _condition(composed(texts), budget)) for label, texts in labelled.items()
    )
    return Experiment(
        name or "custom",
        budget.name,
        conditions,
        _num_replicates(base, budget),
        _settings(RunnerSettings, base.runner, "runner"),
        _settings(ReportSettings, base.report, "report"),
        _changed(name, overrides, only, conditions, composed),
    )


def _changed(
    name: str | None,
    overrides: Mapping[str, Override],
    only: Sequence[str],
    conditions: tuple[Labelled, ...],
    composed: "_Composed",
) -> bool:
    """Whether the conditions differ from those that the experiment has by itself."""
    plain = {key: override for key, override in overrides.items() if key in _NOT_IDENTITY}
    if name is None or (len(plain) == len(overrides) and not only):
        return name is None
    base, labelled = _labelled(name, plain, (), composed)
    if list(labelled) != [label for label, _ in conditions]:
        return True
    budget = _settings(Budget, base.budget, "budget")
    return any(_condition(composed(labelled[label]), budget).id != c.id for label, c in conditions)


def _labelled(
    name: str | None, overrides: Mapping[str, Override], only: Sequence[str], composed: "_Composed"
) -> tuple[DictConfig, dict[str, dict[str, str]]]:
    """Return the first configuration without the experiment's own conditions.

    And each label's overrides.
    """
    choice = {"experiment": f"experiment={name}"} if name else {}
    swept = list(_sweep(overrides))
    base = composed(choice | swept[0][1])
    labels: dict[str, dict[str, str]] = {}
    owner: dict[
        str, str
    ] = {}  # the file's own label of a condition that the command line sweeps over
    entries: Any = OmegaConf.to_container(base.conditions) or {"": []}
    for template, entry in entries.items():
        for label, own in _entry(str(template), entry):
            for suffix, texts in swept:
                joined = JOIN.join(part for part in (label, suffix) if part) or (name or "custom")
                if joined in labels:
                    raise SettingError("conditions", "labels that differ", joined)
                labels[joined], owner[joined] = choice | own | texts, label  # the command line wins
    if unknown := [label for label in only if label not in {*labels, *owner.values()}]:
        raise UnknownOption("--only", unknown[0], labels)
    return base, {
        label: texts
        for label, texts in labels.items()
        if not only or {label, owner[label]} & set(only)
    }


def _condition(config: DictConfig, budget: Budget) -> Condition:
    """Check and build one composed configuration."""
    _cap_generations(config, budget)
    raw = str(OmegaConf.to_container(config.planner, resolve=False))
    try:
        plain: Any = read_files(OmegaConf.to_container(config, resolve=True), file_directories())
    except OmegaConfBaseException as error:
        if absent := [group for group in PLANNER_PARTS if f"key '{group}' not found" in str(error)]:
            raise SettingError(
                absent[0], f"chosen: {', '.join(options(absent[0]))}", None
            ) from None
        raise SettingError(
            error.full_key or "configuration", "resolvable", _first_line(error)
        ) from None
    for group in PLANNER_PARTS:
        if plain.get(group) is not None and group in plain["planner"] and f"${{{group}" not in raw:
            must = f"left as it is; set {group}, the group that it is taken from"
            raise SettingError(f"planner.{group}", must, plain["planner"][group])
        if plain.get(group) is not None:
            if f"${{{group}" not in raw:
                raise SettingError(group, "a part of the chosen planner", plain[group])
            build(plain[group], component_class, group)  # errors name the group, as it was typed
    around = [group for group in AROUND if plain.get(group) is not None]
    if len(around) > 1:
        raise SettingError(
            around[1], f"left out beside a {around[0]}", plain[around[1]].get(TARGET)
        )
    for group in around:
        build(plain["planner"], component_class, "planner")  # likewise
        if TARGET not in plain[group]:
            raise SettingError(group, f"chosen: {', '.join(options(group))}", plain[group])
        if "planner" in plain[group]:
            raise SettingError(
                f"{group}.planner", "left out: it is the chosen planner", plain[group]["planner"]
            )
        plain["planner"] = {**plain[group], "planner": plain["planner"]}
    return Condition.from_config({part: plain[part] for part in (*PARTS, "seed")})


def _cap_generations(config: DictConfig, budget: Budget) -> None:
    cap, ga = budget.max_generations, config.get("ga")
    if cap is not None and ga is not None and isinstance(ga.get("num_generations"), int):
        ga.num_generations = min(ga.num_generations, cap)


def _num_replicates(config: DictConfig, budget: Budget) -> int:
    count = config.num_replicates
    if type(count) is not int or count < 1:
        raise SettingError("num_replicates", "a whole number, at least 1", count)
    return count if budget.max_replicates is None else min(count, budget.max_replicates)


def _settings(kind: type[AnySettings], config: Any, field: str) -> AnySettings:
    plain = OmegaConf.to_container(config, resolve=True)
    assert isinstance(plain, dict)
    values = build(plain, component_class, "")
    try:
        return kind(**values)
    except ValidationError as error:
        raise settings_error(kind, error, values, field) from None


def _entry(template: str, entry: Any) -> Iterator[tuple[str, dict[str, str]]]:
    """Expand one entry of `conditions`: its sweeps crossed, their values filled into its label."""
    field = f"conditions.{template}"
    if not isinstance(entry, list) or not all(isinstance(text, str) for text in entry):
        raise SettingError(field, "a list of overrides", entry)
    parsed = _parse(entry)
    for key, override in parsed.items():
        if _root(key) in _NOT_IDENTITY:
            raise SettingError(
                field, f"free of {key}, which belongs to the whole experiment", override.input_line
            )
    swept = [key for key, override in parsed.items() if override.is_sweep_override()]
    if template.count("{}") not in (0, len(swept)):
        raise SettingError(field, "a label with one {} per swept override, or none", template)
    for suffix, texts in _sweep(parsed):
        if "{}" in template:
            values = [texts[key].split("=", 1)[1] for key in swept]
            pieces = template.split("{}")
            yield (
                pieces[0] + "".join(v + piece for v, piece in zip(values, pieces[1:], strict=True)),
                texts,
            )
        else:
            yield JOIN.join(part for part in (template, suffix) if part), texts


def _sweep(overrides: Mapping[str, Override]) -> Iterator[tuple[str, dict[str, str]]]:
    """Cross all swept overrides; yield (label, single overrides by key) of each combination."""
    swept = [key for key, override in overrides.items() if override.is_sweep_override()]
    short = {key: key.rsplit(".", 1)[-1] for key in swept}
    if len(set(short.values())) < len(short):
        short = {key: key for key in swept}
    for values in itertools.product(*map(_choices, overrides.values())):
        chosen = dict(zip(overrides, values, strict=True))
        label = JOIN.join(f"{short[key]}={chosen[key]}" for key in swept)
        yield label, {key: _text(override, chosen[key]) for key, override in overrides.items()}


_NOT_COMPOSABLE = (HydraException, OmegaConfBaseException, ValueError, TypeError)


class _Composed:
    """Configurations of one expansion.

    Hydra composes every choice of options once, values are set in copies of it.

    Hydra does the same, options first, then values in their order; but it takes a tenth of a second
    and more.
    """

    def __init__(self) -> None:
        self._of_options: dict[tuple[str, ...], DictConfig] = {}

    def __call__(self, overrides: Mapping[str, str]) -> DictConfig:
        try:
            known = groups()
            options = [text for key, text in sorted(overrides.items()) if key in known]
            values = [text for key, text in sorted(overrides.items()) if key not in known]
            parsed = OverridesParser.create().parse_overrides(values)
            if all(value.type is OverrideType.CHANGE for value in parsed):
                config = copy.deepcopy(self._chosen(options))
                for value in parsed:
                    OmegaConf.update(config, value.key_or_group, value.value(), merge=True)
                return config
        except _NOT_COMPOSABLE:
            pass  # it is said below, of all overrides
        return _compose(overrides)

    def _chosen(self, options: list[str]) -> DictConfig:
        key = tuple(options)
        if key not in self._of_options:
            self._of_options[key] = _hydra(options)
        return self._of_options[key]


def _compose(overrides: Mapping[str, str]) -> DictConfig:
    try:
        # In the order of the keys, so that the order in which they were typed does not matter (a.b
        # comes before a.b.c).
        return _hydra([overrides[key] for key in sorted(overrides)])
    except _NOT_COMPOSABLE as error:
        raise _said_in_one_line(error, overrides) from None


def _said_in_one_line(error: Exception, overrides: Mapping[str, str]) -> EvoexpError:
    text = str(error)
    if missing := re.search(r"You must specify '([^']+)'", text):
        group = missing[1]
        experiments = ", ".join(options("experiment"))
        if "experiment" not in overrides:
            must = f"chosen: {experiments} (without one, every group is needed; the next is {group}"
            return SettingError("experiment", f"{must}: {', '.join(options(group))})", None)
        return SettingError(group, f"chosen: {', '.join(options(group))}", None)
    if unknown := re.search(r"Could not (?:override|delete)[^']*'([^']+)'", text):
        return _unknown(unknown[1], overrides)
    if absent := re.search(r"Could not find '([^'/]+)/([^']+)'", text):
        return UnknownOption(absent[1], absent[2], options(absent[1]))
    if there := re.search(r"An item is already at '([^']+)'", text):
        return SettingError(
            there[1], "given without +, it is there already", overrides.get(there[1])
        )
    if merging := re.search(r"Error merging override \+*([^=\s]+)=(.*)", text):
        return SettingError(merging[1], "a setting that is there and takes this value", merging[2])
    return SettingError(
        "configuration", "composable", f"{_first_line(error)} ({' '.join(overrides.values())})"
    )


def _unknown(field: str, overrides: Mapping[str, str]) -> EvoexpError:
    """Name the first part of an unknown key that does not exist, and what stands there instead."""
    if (group := field.split("=")[0]) in groups():
        return SettingError(group, "an option that is chosen, to be deleted", overrides.get(group))
    node: Any = _hydra([text for key, text in overrides.items() if key in groups()])
    parts = field.split(".")
    for k, part in enumerate(parts):
        if isinstance(node, DictConfig) and part in node:
            if OmegaConf.is_interpolation(node, part):
                return SettingError(
                    field,
                    f"given as {'.'.join(parts[k:])}, the group that {part} is taken from",
                    None,
                )
            node = node.get(part)
        elif isinstance(node, ListConfig) and part.isdigit() and int(part) < len(node):
            node = node[int(part)]
        else:
            known = (
                [str(key) for key in node if key != TARGET] if isinstance(node, DictConfig) else []
            )
            return UnknownSetting(
                ".".join(parts[: k + 1]), known + (_in_groups(part, node) if k == 0 else [])
            )
    return SettingError(field, "left in place", None)


def _in_groups(name: str, config: DictConfig) -> list[str]:
    """Return the setting of a group that was perhaps meant by a name given without its group."""
    if nearest(name, map(str, config)):
        return []
    plain: Any = OmegaConf.to_container(config, resolve=False)
    found = {
        key: f"{group}.{key}"
        for group, node in plain.items()
        if isinstance(node, dict)
        for key in node
    }
    return [found[near] for near in difflib.get_close_matches(name, list(found), n=1, cutoff=0.8)]


def _parse(overrides: Sequence[str]) -> dict[str, Override]:
    """Parse overrides, each key once; refuse what can be refused before anything is composed."""
    parser = OverridesParser.create()
    parsed: dict[str, Override] = {}
    for text in overrides:
        try:
            override = parser.parse_override(text)
        except (HydraException, ValueError):
            raise SettingError("override", "key=value", text) from None
        key = override.key_or_group
        _check_key(override, text)
        if key in parsed and parsed[key].input_line != text:
            raise SettingError(key, "given once", f"{parsed[key].input_line} {text}")
        if key in groups() and not override.is_delete():
            _check_options(override)
        parsed[key] = override
    return parsed


def _check_key(override: Override, text: str) -> None:
    """Refuse keys that no override can have."""
    key = override.key_or_group
    if not key or override.package is not None or override.input_line is None:
        raise SettingError("override", "key=value", text)
    if re.split("[./]", key)[0] == "hydra":
        raise SettingError("override", "a setting of evoexp (nothing of Hydra's own)", text)
    if _root(key) == "conditions":
        raise SettingError(
            "conditions", "left to the experiment's file (choose among them: --only LABEL)", text
        )
    if key == "budget.name":
        raise SettingError("budget.name", "left as it is: claims are judged by it", text)
    roots = [*groups(), "seed", "num_replicates"]
    if (override.is_add() or override.is_force_add()) and _root(key) not in roots:
        raise UnknownSetting(key, roots)
    if override.is_delete() and key in roots and key not in _OPTIONAL:
        raise SettingError(key, "given", text)


_OPTIONAL = (
    "experiment",
    *AROUND,
    *PLANNER_PARTS,
)  # groups without which a configuration may be complete


def _check_options(override: Override) -> None:
    """Refuse group choices that do not exist, before composing anything."""
    group = override.key_or_group
    for name in _choices(override):
        if name not in options(group) and not (name == "null" and group in _OPTIONAL):
            raise UnknownOption(group, name, options(group))


def _choices(override: Override) -> list[str]:
    """Return the values of an override, several if it is swept."""
    if not override.is_sweep_override():
        return [_value(override)]
    if override.value_type not in (
        ValueType.SIMPLE_CHOICE_SWEEP,
        ValueType.CHOICE_SWEEP,
        ValueType.RANGE_SWEEP,
    ):
        raise SettingError(
            override.key_or_group,
            "values that can be enumerated: a,b,c or range(…)",
            _value(override),
        )
    return list(override.sweep_string_iterator())


def _root(key: str) -> str:
    return re.split("[./]", key)[0]


def _value(override: Override) -> str:
    return str(override.input_line).split("=", 1)[-1]


def _text(override: Override, value: str) -> str:
    """Return an override with one value as Hydra takes it: `~group` for `group=null`."""
    if override.is_delete():
        return str(override.input_line)
    if override.key_or_group in groups() and value == "null":
        return f"~{override.key_or_group}"
    return f"{override.get_key_element()}={value}"


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]
