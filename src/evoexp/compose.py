"""From overrides to conditions; the only file that knows Hydra.

One function expands an experiment for every command. Whatever is wrong with a configuration is found here, before
anything is computed, and said in one line.
"""

import hashlib
import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import hydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from pydantic import ValidationError

from evoexp.batch.settings import RunnerSettings
from evoexp.condition import PARTS, Condition, component_class
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting
from evoexp.report.settings import ReportSettings
from evoexp.validation import Count, Settings, build, settings_error

PLANNER_PARTS = ("ga", "objective", "collision")  # groups that a planner's option takes in by interpolation
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


class Labelled(NamedTuple):
    """A condition under the name that figures give it."""

    label: str
    condition: Condition


class Experiment(NamedTuple):
    """What one call asks for.

    Attributes:
        name: Of the experiment file; "custom" without one.
        budget: Name of the budget.
        conditions: In the order of the file; two labels may share a condition.
        num_replicates: Of every condition.
        runner: How to run them.
        report: How to report them.
        changed: Whether overrides or `--only` make this another set of conditions than the file's own.
    """

    name: str
    budget: str
    conditions: tuple[Labelled, ...]
    num_replicates: int
    runner: RunnerSettings
    report: ReportSettings
    changed: bool

    @property
    def report_name(self) -> str:
        """Directory of its report: `<experiment>[@budget][+hash of what was changed]`."""
        name = self.name if self.budget == "paper" else f"{self.name}@{self.budget}"
        if not self.changed:
            return name
        text = "\n".join(f"{label}\t{condition.id}" for label, condition in self.conditions)
        return f"{name}+{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def config_directory() -> Path:
    """Return the shipped `conf`: in the wheel inside the package, in a checkout beside `src`."""
    inside = Path(__file__).parent / "conf"
    return inside if inside.is_dir() else Path(__file__).parents[2] / "conf"


def options(group: str) -> list[str]:
    """Return the names of a group's shipped options."""
    return sorted(path.stem for path in (config_directory() / group).glob("*.yaml"))


def expand(overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()) -> list[Experiment]:
    """Expand overrides into experiments, one per `experiment=` swept over.

    Args:
        overrides: As typed: `experiment=rana_planar ga.population_size=20`.
        multirun: Whether values with commas are swept over.
        only: Labels to keep; empty keeps all.

    Raises:
        EvoexpError: For whatever cannot be run; nothing has been computed then.
    """
    parsed = _parse(overrides)
    if not multirun:
        for override in parsed:
            if override.is_sweep_override():
                raise SettingError(_key(override), "one value (or add -m to sweep over several)", _value(override))
    _check_groups(parsed)
    chosen = [_value(o) for o in parsed if o.get_key_element() == "experiment"][-1:]
    rest = [override for override in parsed if override.get_key_element() != "experiment"]
    names = chosen[0].split(",") if chosen else [None]
    with hydra.initialize_config_dir(str(config_directory().resolve()), version_base="1.3"):
        return [_expand_one(name, rest, only) for name in names]


def _expand_one(name: str | None, overrides: Sequence[Override], only: Sequence[str]) -> Experiment:
    choice = [f"experiment={name}"] if name else []
    singles = [_text(override) for override in overrides if not override.is_sweep_override()]
    base = _compose([*choice, *singles])
    entries = OmegaConf.to_container(base.conditions) or {"": []}
    if not isinstance(entries, dict):
        raise SettingError("conditions", "a mapping of labels to lists of overrides", entries)
    labels: dict[str, list[str]] = {}
    for template, entry in entries.items():
        for label, own in _entry(str(template), entry):
            for suffix, swept in _sweep(overrides):
                joined = JOIN.join(part for part in (label, suffix) if part) or (name or "custom")
                if joined in labels:
                    raise SettingError("conditions", "labels that differ", joined)
                labels[joined] = [*choice, *own, *swept]
    if unknown := [label for label in only if label not in labels]:
        raise UnknownOption("--only", unknown[0], labels)
    kept = {label: text for label, text in labels.items() if not only or label in only}
    configs = {label: _compose(text) for label, text in kept.items()}
    budget = _settings(Budget, base.budget, "budget")
    conditions = tuple(Labelled(label, _condition(config, budget)) for label, config in configs.items())
    changes = [o for o in overrides if o.get_key_element().split(".")[0] not in _NOT_IDENTITY]
    return Experiment(
        name or "custom",
        budget.name,
        conditions,
        _num_replicates(base, budget),
        _settings(RunnerSettings, base.runner, "runner"),
        _settings(ReportSettings, base.report, "report"),
        bool(changes or only or not name),
    )


_NOT_IDENTITY = {"experiment", "budget", "num_replicates", "runner", "report"}


def _condition(config: DictConfig, budget: Budget) -> Condition:
    """Check and build one composed configuration."""
    _cap_generations(config, budget)
    raw = str(OmegaConf.to_container(config.planner, resolve=False))
    try:
        plain = OmegaConf.to_container(config, resolve=True)
    except OmegaConfBaseException as error:
        raise SettingError(error.full_key or "configuration", "resolvable", _first_line(error)) from None
    assert isinstance(plain, dict)
    for group in PLANNER_PARTS:
        if plain.get(group) is not None:
            if f"${{{group}" not in raw:
                raise SettingError(group, "a part of the chosen planner", plain[group])
            build(plain[group], component_class, group)  # errors name the group, as it was typed
    if plain.get("control") is not None:
        plain["planner"] = {**plain["control"], "planner": plain["planner"]}
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


def _entry(template: str, entry: Any) -> Iterator[tuple[str, list[str]]]:
    """Expand one entry of `conditions`: its sweeps crossed, their values filled into its label."""
    if not isinstance(entry, list) or not all(isinstance(text, str) for text in entry):
        raise SettingError(f"conditions.{template}", "a list of overrides", entry)
    parsed = _parse(entry)
    _check_groups(parsed)
    if template.count("{}") not in (0, sum(override.is_sweep_override() for override in parsed)):
        raise SettingError(f"conditions.{template}", "a label with one {} per swept override, or none", template)
    for suffix, texts in _sweep(parsed):
        if "{}" in template:
            values = [text.split("=", 1)[1] for text, o in zip(texts, parsed, strict=True) if o.is_sweep_override()]
            yield template.format(*values), texts
        else:
            yield JOIN.join(part for part in (template, suffix) if part), texts


def _sweep(overrides: Sequence[Override]) -> Iterator[tuple[str, list[str]]]:
    """Cross all swept overrides; yield a label of the swept ones and the list of single overrides."""
    choices = []
    for override in overrides:
        if override.is_sweep_override():
            choices.append([f"{override.get_key_element()}={value}" for value in override.sweep_string_iterator()])
        else:
            choices.append([_text(override)])
    for texts in itertools.product(*choices):
        swept = [text for text, o in zip(texts, overrides, strict=True) if o.is_sweep_override()]
        yield JOIN.join(text.rsplit(".", 1)[-1] if "." in text.split("=")[0] else text for text in swept), list(texts)


def _compose(overrides: list[str]) -> DictConfig:
    try:
        return hydra.compose("config", overrides=overrides)
    except (HydraException, OmegaConfBaseException) as error:
        raise _said_in_one_line(error, overrides) from None


def _said_in_one_line(error: Exception, overrides: list[str]) -> EvoexpError:
    text = str(error)
    if missing := re.search(r"You must specify '([^']+)'", text):
        group = missing[1]
        hint = f" (options: {', '.join(options(group))}), or choose an experiment: {', '.join(options('experiment'))}"
        return SettingError(group, f"chosen{hint}", None)
    if unknown := re.search(r"Could not (?:override|delete)[^']*'([^']+)'", text):
        return UnknownSetting(unknown[1], _known_beside(unknown[1], overrides))
    if absent := re.search(r"Could not find '([^'/]+)/([^']+)'", text):
        return UnknownOption(absent[1], absent[2], options(absent[1]))
    return SettingError("configuration", "composable", _first_line(error))


def _known_beside(field: str, overrides: list[str]) -> list[str]:
    """Return the keys that stand where an unknown one was given."""
    groups = {path.name for path in config_directory().iterdir() if path.is_dir()}
    node: Any = hydra.compose("config", overrides=[text for text in overrides if text.split("=")[0] in groups])
    for part in field.split(".")[:-1]:
        node = node.get(part) if isinstance(node, DictConfig) else None
    return [str(key) for key in node] if isinstance(node, DictConfig) else []


def _parse(overrides: Sequence[str]) -> list[Override]:
    parser = OverridesParser.create()
    parsed = []
    for text in overrides:
        try:
            parsed.append(parser.parse_override(text))
        except HydraException:
            raise SettingError("override", "key=value", text) from None
        if parsed[-1].get_key_element().startswith("hydra"):
            raise SettingError("override", "a setting of evoexp (nothing of Hydra's own)", text)
    return parsed


def _check_groups(overrides: Sequence[Override]) -> None:
    """Refuse group choices that do not exist, before composing anything."""
    for override in overrides:
        group = override.get_key_element()
        if (config_directory() / group).is_dir():
            known = options(group)
            for name in _value(override).split(","):
                if name not in known and not (name == "null" and group in ("experiment", "control", *PLANNER_PARTS)):
                    raise UnknownOption(group, name, known)


def _key(override: Override) -> str:
    return str(override.get_key_element())


def _value(override: Override) -> str:
    return _text(override).split("=", 1)[-1]


def _text(override: Override) -> str:
    assert override.input_line is not None
    return override.input_line


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]


def description(experiment: str) -> str:
    """Return the line of an experiment file that says what it is: its third."""
    lines = (config_directory() / "experiment" / f"{experiment}.yaml").read_text().splitlines()
    return lines[2].removeprefix("# ")
