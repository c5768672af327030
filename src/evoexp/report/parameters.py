"""Parameters of conditions with unit and source, as the comments of the shipped options state them.

A condition does not know which options it was composed of, so each of its components is compared
with all shipped options of its group: the one that agrees in most settings is named, and settings
that differ from it are overrides.
"""

import functools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from evoexp.attachments import FILE, SHA256, keep
from evoexp.condition import PARTS
from evoexp.report.results import WRAPPED, ConditionResults, Results
from evoexp.shipped import config_directory
from evoexp.validation import TARGET

OVERRIDE = "override"
_COMMENT = re.compile(r"#\s*(?:\[(?P<unit>[^\]]*)\])?\s*(?P<source>.*)")
_REFERENCE = re.compile(r"\$\{(\w+)\}")
_SHARED = re.compile(r"\$\{(\w+\.[\w.]+)\}")  # one setting of another group


class Entry(NamedTuple):
    """One value of an option file, and what its comment says."""

    value: Any
    unit: str
    source: str


class Parameter(NamedTuple):
    """One setting of a condition.

    Attributes:
        name: As one types it: `ga.population_size`.
        value: As text.
        unit: Of the value; empty where the option states none.
        source: "paper: …", "assumed: …", "override", "budget smoke", or the comment as it is.
    """

    name: str
    value: str
    unit: str
    source: str


def parameters(results: Results, condition: ConditionResults) -> list[Parameter]:
    """Return all settings of one condition, its seed and its number of replicates."""
    config = {part: getattr(condition.condition, part).canonical() for part in PARTS}
    preferred = _choices(results.experiment)
    found: list[Parameter] = []
    for part, value in config.items():
        if WRAPPED in value:  # a control or a reference around the planner
            outer = {key: v for key, v in value.items() if key != WRAPPED}
            found += _component(
                "reference" if condition.is_reference else "control", outer, preferred
            )
            value = value[WRAPPED]
        found += _component(part, value, preferred)
    root = option(config_directory() / "config.yaml")
    found.append(_parameter("seed", condition.condition.seed, root.get("seed"), OVERRIDE))
    planned = Entry(planned_replicates(results.experiment), *root["num_replicates"][1:])
    if not condition.is_reference:  # which has one, whatever is planned
        found.append(_parameter("num_replicates", condition.planned, planned, OVERRIDE))
    return [_capped(parameter, results.budget) for parameter in found]


def planned_replicates(experiment: str) -> int:
    """Return the number of replicates that an experiment has without any cap or override."""
    path = config_directory() / "experiment" / f"{experiment}.yaml"
    own = yaml.safe_load(path.read_text()).get("num_replicates") if path.is_file() else None
    return int(
        own
        if own is not None
        else option(config_directory() / "config.yaml")["num_replicates"].value
    )


def overridden(found: Iterable[Parameter]) -> list[str]:
    """Return the names of settings that are no longer the paper's.

    Another seed is as good as any.
    """
    changed = (p for p in found if p.source == OVERRIDE or p.source.startswith("budget"))
    return [p.name for p in changed if p.name != "seed"]


@functools.cache
def option(path: Path) -> dict[str, Entry]:
    """Return the values of an option file with their comments, by dotted key.

    Its defaults filled in.
    """
    text = path.read_text()
    node = yaml.compose(text)
    entries: dict[str, Entry] = {}
    for base in yaml.safe_load(text).get("defaults", ()):
        if base != "_self_" and (isinstance(base, str) or all("@" in key for key in base)):
            entries |= _taken_in(base, path, entries)
    for key, leaf in _leaves(node, ""):
        value = yaml.safe_load(yaml.serialize(leaf))
        if key.endswith(f".{FILE}"):  # conditions know files by their content
            key, value = key.removesuffix(FILE) + SHA256, keep((path.parent / value).read_bytes())
        entries[key] = Entry(value, *_comment(text.splitlines(), leaf))
    return entries


def _taken_in(base: Any, path: Path, entries: dict[str, Entry]) -> dict[str, Entry]:
    """Return the entries of an option that another one takes in.

    `name`, `name@part` or `/group@part: name`.
    """
    key, name = next(iter(base.items())) if isinstance(base, dict) else ("", str(base))
    name, _, part = name.partition("@")
    if key:
        group, _, part = key.removeprefix("/").partition("@")
        entries.pop(part, None)  # what stood there was taken from a group
        return {
            f"{part}.{own}": entry
            for own, entry in option(path.parents[1] / group / f"{name}.yaml").items()
        }
    prefix = f"{part}." if part else ""
    return {prefix + own: entry for own, entry in option(path.parent / f"{name}.yaml").items()}


def _leaves(node: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield (dotted key, node) of every scalar and every list that is written in one line."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if prefix or key.value != "defaults":
                yield from _leaves(value, f"{prefix}.{key.value}" if prefix else key.value)
    elif isinstance(node, yaml.SequenceNode) and not node.flow_style:
        for k, value in enumerate(node.value):
            yield from _leaves(value, f"{prefix}[{k}]")
    else:
        yield prefix, node


def _comment(lines: list[str], node: Any) -> tuple[str, str]:
    line = lines[node.end_mark.line] if node.end_mark.line < len(lines) else ""
    match = _COMMENT.match(line[node.end_mark.column :].strip())
    if match is None:
        return "", ""
    unit = (match["unit"] or "").strip()
    return "" if unit == "-" else unit, match["source"].strip()


def _component(
    group: str, config: dict[str, Any], preferred: dict[str, str]
) -> Iterator[Parameter]:
    """Yield the settings of one component, and of the groups that its option takes in."""
    name, entries = _option_of(group, config, preferred.get(group))
    revision = config.get("revision")
    where = f"conf/{group}/{name}.yaml" if name else OVERRIDE
    yield Parameter(group, f"{config[TARGET]}, revision {revision}", "", where)
    for key, value in config.items():
        if key in (TARGET, "revision"):
            continue
        yield from _setting(group, key, value, entries, preferred)


def _setting(
    group: str, key: str, value: Any, entries: dict[str, Entry], preferred: dict[str, str]
) -> Iterator[Parameter]:
    """Yield a setting; of a component in a component its settings."""
    reference = _REFERENCE.fullmatch(str(entries[key].value)) if key in entries else None
    if reference and isinstance(value, dict):
        yield from _component(reference[1], value, preferred)
    elif isinstance(value, dict) and TARGET in value:
        for name, item in value.items():
            if name not in (TARGET, "revision"):
                yield from _setting(group, f"{key}.{name}", item, entries, preferred)
    else:
        for path, leaf in _flat(value, key):
            yield _parameter(f"{group}.{path}", leaf, entries.get(path), OVERRIDE)


def _option_of(
    group: str, config: dict[str, Any], preferred: str | None
) -> tuple[str, dict[str, Entry]]:
    """Return name and entries of the shipped option that is nearest to a component."""
    leaves = dict(_flat(config, ""))
    best: tuple[tuple[int, bool], str, dict[str, Entry]] = ((-(10**9), False), "", {})
    for path in sorted((config_directory() / group).glob("*.yaml")):
        entries = option(path)
        if TARGET not in entries or entries[TARGET].value != config[TARGET]:
            continue
        agreeing = sum(
            _same(value, entries[key].value) for key, value in leaves.items() if key in entries
        )
        lacking = sum(
            key not in leaves
            for key, entry in entries.items()
            if not _REFERENCE.match(str(entry.value))
        )
        score = (agreeing - lacking, path.stem == preferred)
        if score > best[0]:
            best = (score, path.stem, entries)
    return best[1:]


@functools.cache
def _choices(experiment: str) -> dict[str, str]:
    """Return the option that an experiment file chooses for every group."""
    path = config_directory() / "experiment" / f"{experiment}.yaml"
    if not experiment or not path.is_file():
        return {}
    chosen = {}
    for entry in yaml.safe_load(path.read_text()).get("defaults", ()):
        for key, name in entry.items() if isinstance(entry, dict) else ():
            chosen[key.removeprefix("override ").lstrip("/")] = name
    return chosen


def _flat(value: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield (dotted key, leaf) of canonical data; lists of plain values are leaves."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key != "revision" and not (prefix and key == TARGET):
                yield from _flat(item, f"{prefix}.{key}" if prefix else key)
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for k, item in enumerate(value):
            yield from _flat(item, f"{prefix}[{k}]")
    else:
        yield prefix, value


def _parameter(name: str, value: Any, entry: Entry | None, otherwise: str) -> Parameter:
    if entry is None:
        return Parameter(name, _text(value), "", otherwise)
    if shared := _SHARED.fullmatch(str(entry.value)):
        return Parameter(name, _text(value), "", f"as {shared[1]}")
    source = entry.source if _same(value, entry.value) else otherwise
    return Parameter(name, _text(value), entry.unit, source)


def _capped(parameter: Parameter, budget: str) -> Parameter:
    """Name the budget where it, and no override, made a setting what it is."""
    path = config_directory() / "budget" / f"{budget}.yaml"
    if parameter.source != OVERRIDE or not budget or not path.is_file():
        return parameter
    key = {"num_replicates": "max_replicates", "ga.num_generations": "max_generations"}.get(
        parameter.name
    )
    caps = option(path)
    if key in caps and str(caps[key].value) == parameter.value:
        return parameter._replace(source=f"budget {budget}")
    return parameter


def _same(value: Any, shipped: Any) -> bool:
    if isinstance(value, list) and isinstance(shipped, list):
        return len(value) == len(shipped) and all(
            _same(a, b) for a, b in zip(value, shipped, strict=True)
        )
    if isinstance(shipped, str) and isinstance(value, float):  # 1e-3 is a text to YAML 1.1
        try:
            return float(shipped) == value
        except ValueError:
            return False
    return bool(value == shipped)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return repr(value) if isinstance(value, float) else str(value)
