"""Parameters of conditions with unit and source, as the comments of their option files state them.

An experiment records the option that each group of a condition was taken from; a setting that
differs from its option is an override. Without that record a setting has no source.
"""

import functools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from evoexp.attachments import FILE, SHA256, keep
from evoexp.condition import PARTS
from evoexp.report.results.stored_results import WRAPPED, ConditionResults, Results
from evoexp.shipped import Option, config_directory
from evoexp.validation import TARGET

OVERRIDE = "override"
OF_FILE = "content of a file"
NOT_RECORDED = "its option is not recorded"
_CAPS = {"num_replicates": "max_replicates", "ga.num_generations": "max_generations"}
_COMMENT = re.compile(r"#\s*(?:\[(?P<unit>[^\]]*)\])?\s*(?P<source>.*)")
_REFERENCE = re.compile(r"\$\{(\w+)\}")
_SHARED = re.compile(r"\$\{(\w+\.[\w.]+)\}")  # one setting of another group


class Entry(NamedTuple):
    """One value of an option file with the unit and the source that its comment names."""

    value: Any
    unit: str
    source: str


class Parameter(NamedTuple):
    """One setting of a condition."""

    name: str  # as one types it: `ga.population_size`
    value: str  # as text
    unit: str  # of the value; empty where the option states none
    source: str  # "paper: …", "assumed: …", "override", "budget smoke", or the comment as it is


def parameters(results: Results, condition: ConditionResults) -> list[Parameter]:
    """Return all settings of one condition, its seed and its number of replicates."""
    config = {part: getattr(condition.condition, part).canonical() for part in PARTS}
    taken = {each.group: each for each in condition.options}
    found: list[Parameter] = []
    for part, value in config.items():
        if WRAPPED in value:  # a control or a reference around the planner
            outer = {key: v for key, v in value.items() if key != WRAPPED}
            around = "reference" if condition.is_reference else "control"
            found += _component(around, outer, taken)
            value = value[WRAPPED]
        found += _component(part, value, taken)
    root = option(config_directory() / "config.yaml")
    found.append(_parameter("seed", condition.condition.seed, root.get("seed"), OVERRIDE))
    if (most := condition.condition.max_collision_queries) is not None:
        own = _of_experiment(results).get(name := "budget.collision_queries")
        found.append(_parameter(name, most, own, OVERRIDE))
    if not condition.is_reference:  # which has one replicate, however many are planned
        planned = Entry(planned_replicates(results), *root["num_replicates"][1:])
        found.append(_parameter("num_replicates", condition.planned, planned, OVERRIDE))
    caps = _entries("budget", results.budget, taken)
    for k, parameter in enumerate(found):  # a setting that the budget changed, and no override
        cap = caps.get(_CAPS.get(parameter.name, ""))
        if parameter.source == OVERRIDE and cap and str(cap.value) == parameter.value:
            found[k] = parameter._replace(source=f"budget {results.budget}")
    return found


def planned_replicates(results: Results) -> int:
    """Return the number of replicates that an experiment has without any cap or override."""
    name = "num_replicates"
    default = option(config_directory() / "config.yaml")[name]
    return int(_of_experiment(results).get(name, default).value)


def _of_experiment(results: Results) -> dict[str, Entry]:
    """Return the settings in the file of the experiment itself, by dotted key."""
    taken = {each.group: each for c in results.conditions for each in c.options}
    return _entries("experiment", results.experiment, taken)


def _entries(group: str, name: str, taken: dict[str, Option]) -> dict[str, Entry]:
    """Return the option taken of a group, else the shipped one; nothing if there is no file."""
    shipped = config_directory() / group / f"{name}.yaml"
    path = Path(taken[group].path) if group in taken else shipped
    return option(path) if path.is_file() else {}


def overridden(found: Iterable[Parameter]) -> list[str]:
    """Return the names of settings that are no longer the paper's.

    Any seed is as good as its own, and more replicates are no worse.
    """
    changed = (p for p in found if p.source == OVERRIDE or p.source.startswith("budget"))
    return [p.name for p in changed if p.name not in ("seed", "num_replicates")]


@functools.cache
def option(path: Path) -> dict[str, Entry]:
    """Return the values of an option file, its defaults filled in, with comments, by dotted key."""
    text = path.read_text()
    entries: dict[str, Entry] = {}
    # options that it takes in: `name`, `name@part` or `/group@part: name`
    for base in yaml.safe_load(text).get("defaults", ()):
        if isinstance(base, dict) and all("@" in key for key in base):
            ((key, name),) = base.items()
            group, _, part = key.removeprefix("/").partition("@")
            entries.pop(part, None)  # of a part that a group is taken in for, the group goes
        elif isinstance(base, str) and base != "_self_":
            group, (name, _, part) = path.parent.name, base.partition("@")
        else:
            continue
        beside = path.parents[1] / group / f"{name}.yaml"  # else it is a shipped one
        own = option(beside if beside.is_file() else config_directory() / group / f"{name}.yaml")
        entries |= {f"{part}.{key}" if part else key: entry for key, entry in own.items()}
    lines = text.splitlines()
    for key, leaf in _leaves(yaml.compose(text), ""):
        value = yaml.safe_load(yaml.serialize(leaf))
        if key.endswith(f".{FILE}"):  # conditions know files by their content
            key, value = key.removesuffix(FILE) + SHA256, keep((path.parent / value).read_bytes())
        mark = leaf.end_mark
        line = lines[mark.line] if mark.line < len(lines) else ""
        comment = _COMMENT.match(line[mark.column :].strip())
        unit, source = ((part or "").strip() for part in comment.groups()) if comment else ("", "")
        entries[key] = Entry(value, "" if unit == "-" else unit, source)
    return entries


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


def _component(group: str, config: dict[str, Any], taken: dict[str, Option]) -> Iterator[Parameter]:
    """Yield the settings of one component, and of the groups that its option takes in."""
    where = taken[group].source if group in taken else NOT_RECORDED
    entries = _entries(group, "", taken)
    otherwise = OVERRIDE if entries else where  # of a setting that the option does not have

    def parts(key: str, value: Any, is_of_file: bool = False) -> Iterator[Parameter]:
        """Yield a setting, part by part; lists of plain values are one part.

        `is_of_file` tells that it stands beside the hash of a file, and may be the file's content.
        """
        reference = _REFERENCE.fullmatch(str(entries[key].value)) if key in entries else None
        if reference and isinstance(value, dict):
            yield from _component(reference[1], value, taken)
        elif isinstance(value, dict):
            for name, item in value.items():
                if name not in (TARGET, "revision"):
                    yield from parts(f"{key}.{name}", item, FILE in value)
        elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
            for k, item in enumerate(value):
                yield from parts(f"{key}[{k}]", item, is_of_file)
        else:
            is_unknown = key not in entries and (is_of_file or key.endswith(f".{SHA256}"))
            unknown = OF_FILE if is_unknown else otherwise
            yield _parameter(f"{group}.{key}", value, entries.get(key), unknown)
        items = {path[len(key) :].split("]")[0] for path in entries if path.startswith(f"{key}[")}
        if isinstance(value, list) and len(items) > len(value):  # a list cut short
            yield Parameter(f"{group}.{key}", f"{len(value)} of {len(items)}", "", otherwise)

    yield Parameter(group, f"{config[TARGET]}, revision {config.get('revision')}", "", where)
    for key, value in config.items():
        if key not in (TARGET, "revision"):
            yield from parts(key, value)


def _parameter(name: str, value: Any, entry: Entry | None, otherwise: str) -> Parameter:
    if entry is None:
        return Parameter(name, _text(value), "", otherwise)
    if shared := _SHARED.fullmatch(str(entry.value)):
        return Parameter(name, _text(value), "", f"as {shared[1]}")
    source = entry.source if _same(value, entry.value) else otherwise
    return Parameter(name, _text(value), entry.unit, source)


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
