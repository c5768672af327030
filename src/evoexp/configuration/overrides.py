"""Overrides: settings as one types them, `key=value`, collected, swept over, labelled and assigned.

A dotted path leads through mappings by their keys and through lists by indices that begin at 0:
`scenario.phases.0.contacts=[…]`. A path may lead to a setting that the option does not mention: the
component decides whether it has such a setting.
"""

import contextlib
import copy
import difflib
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from evoexp.configuration.search_path import EXPERIMENT, find, groups, options
from evoexp.errors import EvoexpError, SettingError, UnknownSetting, demand, nearest
from evoexp.registry import component_class
from evoexp.validation import TARGET

ADD, FORCE, DELETE = "+", "++", "~"  # prefixes of an override; without one it sets a value
JOIN = " · "  # between the parts of a label
PLANNER_PARTS = ("ga", "objective", "collision")  # groups that a planner takes in by interpolation
AROUND = ("control", "reference")  # groups whose option is put around the chosen planner
SWEEP = "sweep"  # the group that has settings searched
SEARCHED = ("planner", "ga", "control")  # groups whose swept settings are searched
# groups that a configuration may do without
OPTIONAL = (EXPERIMENT, SWEEP, *AROUND, *PLANNER_PARTS)
NOT_IDENTITY = (EXPERIMENT, "budget", "num_replicates", "runner", "report", SWEEP)
SCALARS = ("seed", "num_replicates")  # settings outside the groups
HYDRAS_OWN = {
    "launcher": "runner=serial, loky or dask",
    "sweeper": "evoexp run -m crosses all values, sweep=optuna searches them",
    "run": "EVOEXP_OUTPUTS names the folder",
    "sweep": "EVOEXP_OUTPUTS names the folder",
    "job_logging": "results go to outputs, nothing else is logged",
    "searchpath": "--config-dir DIR",
}
"""Part of Hydra's own configuration → what evoexp has instead."""


class Value(NamedTuple):
    """A value of an override."""

    text: str  # as it was typed
    data: Any  # as plain data


class Span(NamedTuple):
    """Numbers that a search may choose from: whole ones if the ends are."""

    low: float
    high: float
    step: float | None = None  # between two of them; None: any number
    is_log: bool = False  # whether it searches by orders of magnitude
    is_interval: bool = True  # not of values that can be enumerated


class Override(NamedTuple):
    """A change of a configuration."""

    prefix: str  # `ADD`, `FORCE`, `DELETE`, or empty
    key: str  # a group, or the dotted path of a setting
    # one value, several if they are swept over, none of a deletion; of an interval its ends
    values: tuple[Value, ...]
    is_swept: bool  # whether the values are swept over
    text: str  # as it was typed
    span: Span | None = None  # of swept numbers

    @property
    def root(self) -> str:
        """First part of the key."""
        return re.split("[./]", self.key)[0]

    @property
    def typed(self) -> str:
        """Everything behind the first `=`."""
        return self.text.partition("=")[2]

    @property
    def word(self) -> str:
        """The override with the first of its values, as one would type it."""
        return f"{self.prefix}{self.key}" + (f"={self.values[0].text}" if self.values else "")

    def option(self) -> str | None:
        """Return the option that an override of a group chooses; None: the group is left out."""
        if self.prefix == DELETE or self.values[0].data is None:
            return None
        text, data = self.values[0]
        return data if isinstance(data, str) else text


Choice = Mapping[str, Override]  # by key, each with one value


def collect(overrides: Iterable[Override]) -> dict[str, Override]:
    """Return overrides by key, after refusing overrides that no configuration can take."""
    by_key: dict[str, Override] = {}
    for override in overrides:
        group, prefix, text = override.key, override.prefix, override.text
        first = by_key.setdefault(group, override).text
        demand(first == text, group, "given once", f"{first} {text}")
        if group not in groups():
            _check_setting(override)
            continue
        demand(prefix != DELETE or group in OPTIONAL, group, "given", text)
        for value in single_values(override):
            name = value.option()
            if name is not None or group not in OPTIONAL:
                find(group, "null" if name is None else name)
        demand(prefix not in (ADD, FORCE), group, f"given without {prefix}", text)
    return by_key


def _check_setting(override: Override) -> None:
    key, root, text = override.key, override.root, override.text
    part = next(iter(re.findall(r"hydra[./](\w+)", key)), "")
    instead = HYDRAS_OWN.get(part, "evoexp show experiment=NAME prints the settings")
    must = f"a setting of evoexp (instead of Hydra's: {instead})"
    demand(root != "hydra", "override", must, text)
    demand("/" not in key, "override", "key=value", text)
    must = "left to the experiment's file (choose among them: --only LABEL)"
    demand(root != "conditions", "conditions", must, text)
    demand(key != "budget.name", key, "left as it is: claims are judged by it", text)
    demand(root != EXPERIMENT, key, "left out: an experiment has no settings of its own", text)
    if override.prefix and root not in (roots := [*groups(), *SCALARS]):
        raise UnknownSetting(key, roots)
    demand(override.prefix != DELETE or key not in SCALARS, key, "given", text)


def refuse_sweeps(overrides: Choice, *, multirun: bool) -> None:
    """Refuse overrides that are swept over but may not be."""
    for key, override in overrides.items():
        must = "values that can be enumerated: a,b,c or range(…)"
        must += " (or searched by sweep=optuna)" if override.root in SEARCHED else ""
        is_interval = override.span is not None and override.span.is_interval
        demand(not is_interval, key, must, override.typed)
        if override.is_swept:
            must = "one value (or add -m to sweep over several)"
            demand(multirun, key, must, override.typed)
            must = "one value: only settings of a condition can be swept"
            may_be = key == EXPERIMENT or override.root not in NOT_IDENTITY
            demand(may_be, key, must, override.typed)
    refuse_equal_values(overrides)


def refuse_equal_values(overrides: Choice) -> None:
    """Refuse overrides that are swept over one value twice."""
    for key, override in overrides.items():
        texts = [value.text for value in override.values]
        differ = key == EXPERIMENT or len(set(texts)) == len(texts)
        demand(differ, key, "values that differ", override.typed)


def search_space(overrides: Choice) -> Choice:
    """Return the overrides that a search chooses values of; none without `sweep=…`."""
    if SWEEP not in overrides or overrides[SWEEP].option() is None:
        return {}
    swept = {key: override for key, override in overrides.items() if override.is_swept}
    space = {key: override for key, override in swept.items() if override.root in SEARCHED}
    must = "beside a swept setting of planner, ga or control: planner.walk_step=interval(1,8)"
    demand(space, SWEEP, must, " ".join(override.text for override in swept.values()))
    refuse_equal_values(space)
    return space


def single_values(override: Override) -> Iterator[Override]:
    """Yield an override with each of its values."""
    if not override.values:
        yield override
    for value in override.values:
        yield override._replace(values=(value,), is_swept=False)


def sweep(overrides: Choice) -> Iterator[dict[str, Override]]:
    """Cross all swept overrides; yield the overrides of each combination, with one value each."""
    for combination in itertools.product(*map(single_values, overrides.values())):
        yield dict(zip(overrides, combination, strict=True))


def sweep_texts(overrides: Choice, choice: Choice) -> dict[str, str]:
    """Return key → `name=value` of the swept overrides that a combination has."""
    short = short_names([key for key, override in overrides.items() if override.is_swept])
    return {
        key: f"{name}={choice[key].values[0].text}" for key, name in short.items() if key in choice
    }


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return key → its last part; the whole keys where several end in the same part."""
    short = {key: key.rsplit(".", 1)[-1] for key in keys}
    return short if len(set(short.values())) == len(short) else {key: key for key in keys}


def expand_entry(
    template: str, overrides: Iterable[Override]
) -> Iterator[tuple[str, dict[str, Override]]]:
    """Yield label and overrides of each condition of an entry, whose sweeps are crossed.

    A template of labels has a `{}` per swept override, or none.
    """
    field, parsed = f"conditions.{template}", collect(overrides)
    for key, override in parsed.items():
        must = f"free of {key}, which belongs to the whole experiment"
        demand(override.root not in NOT_IDENTITY, field, must, override.text)
    swept = [key for key, override in parsed.items() if override.is_swept]
    pieces = template.split("{}")
    must = "a label with one {} per swept override, or none"
    demand(len(pieces) - 1 in (0, len(swept)), field, must, template)
    for chosen in sweep(parsed):
        if len(pieces) > 1:
            values = (chosen[key].values[0].text for key in swept)
            filled = (value + piece for value, piece in zip(values, pieces[1:], strict=True))
            yield pieces[0] + "".join(filled), chosen
        else:
            parts = (template, *sweep_texts(parsed, chosen).values())
            yield JOIN.join(filter(None, parts)), chosen


# assigned to the plain data of composed options


def assigned(config: dict[str, Any], overrides: Choice) -> dict[str, Any]:
    """Return a copy with overrides of settings applied, whatever the order of typing.

    Shorter paths come before longer ones that begin with them, deletions come last and from behind.
    """
    config = copy.deepcopy(config)
    settings = [override for key, override in overrides.items() if key not in groups()]
    by_path = sorted(settings, key=lambda override: _parts(override.key))
    for override in by_path:
        if override.prefix == DELETE:
            continue
        node, last, present = _place(config, override)
        value = override.values[0].data
        if isinstance(present, dict) and isinstance(value, dict):
            _merge(present, value)
        elif present is not None and override.prefix == ADD:
            must = "given without +: it exists already"
            raise SettingError(override.key, must, override.typed)
        elif isinstance(node, list) and last == len(node):
            node.append(value)
        else:
            node[last] = value
    for override in reversed(by_path):
        if override.prefix == DELETE:
            _delete(config, override)
    return config


def known_instead(config: dict[str, Any], override: Override) -> list[str] | None:
    """Return the settings of a component that lacks an overridden one; None if it has that one.

    No names are returned if no option of its group is chosen. In a component that reads files, and
    in all that is no component, a setting is checked with its value.
    """
    root, *parts = override.key.split(".")
    adds = override.prefix in (ADD, FORCE)
    if root in NOT_IDENTITY or root not in groups() or not parts or adds:
        return None
    node = config.get(root)
    if node is None:
        return []
    for part in parts:
        if not isinstance(node, dict):
            return None
        if part not in node and isinstance(name := node.get(TARGET), str):
            with contextlib.suppress(EvoexpError):  # of a component that there is not
                kind = component_class(name, root)
                if part not in kind.model_fields and not hasattr(kind, "read_files"):
                    return list(kind.model_fields)
        node = node.get(part)
    return None


def _parts(key: str) -> list[tuple[int, str]]:
    """Return the parts of a path in a form in which list indices are ordered as numbers."""
    return [(int(part) if part.isdigit() else -1, part) for part in key.split(".")]


def _delete(config: dict[str, Any], override: Override) -> None:
    node, last, present = _place(config, override)
    is_there = not isinstance(node, dict) or last in node
    demand(is_there, override.key, "an existing setting, for ~ to delete", override.text)
    is_meant = not override.values or override.values[0].data == present
    demand(is_meant, override.key, f"{present!r}, for ~ to delete", override.typed)
    del node[last]


def _place(config: dict[str, Any], override: Override) -> tuple[Any, Any, Any]:
    node: Any = config
    *parents, last = override.key.split(".")
    for depth, part in enumerate(parents):
        inner = _child(node, override, depth)
        if inner is None:  # whether there is such a setting is checked with its value
            inner = node[int(part) if isinstance(node, list) else part] = {}
        node = inner
    present = _child(node, override, len(parents))
    return node, int(last) if isinstance(node, list) else last, present


def _child(node: Any, override: Override, depth: int) -> Any:
    """Return the value one step down a path, `depth` parts deep; None if there is no such key."""
    parts = override.key.split(".")
    part, field = parts[depth], ".".join(parts[: depth + 1])
    if isinstance(node, list):
        grows = depth == len(parts) - 1 and override.prefix in (ADD, FORCE)
        if not part.isdecimal() or int(part) >= len(node) + grows:
            above, length = field.rpartition(".")[0], len(node)
            one = "the index 0" if length == 1 else f"an index from 0 to {length - 1}"
            must = f"{one} (+{above}.{length}=… adds one)"
            empty = f"added with +{above}.0: the list is empty"
            raise SettingError(field, must if node else empty, part)
        return node[int(part)] if int(part) < len(node) else None
    if not isinstance(node, dict):
        above = ".".join(parts[:depth])
        if isinstance(node, str) and node.startswith("${"):
            group = node[2:].rstrip("}")
            must = f"given as {'.'.join([group, *parts[depth:]])}, the group of {above}"
            raise SettingError(override.key, must, override.typed)
        raise SettingError(field, f"left out: {above} is one value, {node!r}", override.typed)
    if depth == 0 and part not in node and not override.prefix:
        if part in groups():
            raise SettingError(part, f"chosen: {', '.join(options(part))}", None)
        # the setting of a group that was perhaps meant by a name given without its group
        named = {key: f"{group}.{key}" for group in groups() for key in node.get(group) or ()}
        near = difflib.get_close_matches(part, named.keys() - {TARGET}, n=1, cutoff=0.8)
        meant = [] if nearest(part, node) else [named[key] for key in near]
        raise UnknownSetting(part, [*groups(), *SCALARS, *meant])
    return node.get(part)


def _merge(present: dict[str, Any], value: dict[str, Any]) -> None:
    for key, item in value.items():
        inner = present.get(key)
        if isinstance(inner, dict) and isinstance(item, dict):
            _merge(inner, item)
        else:
            present[key] = item
