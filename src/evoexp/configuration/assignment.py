"""Assignment: overrides of settings, applied to the plain data of composed options.

A dotted path leads through mappings by their keys and through lists by indices that begin at 0:
`scenario.phases.0.contacts=[…]`. A path may lead to a setting that the option does not mention: the
component decides whether it has such a setting.
"""

import contextlib
import difflib
from typing import Any

from evoexp.configuration.overrides import (
    ADD,
    DELETE,
    FORCE,
    NOT_IDENTITY,
    SCALARS,
    Choice,
    Override,
)
from evoexp.configuration.search_path import groups, options
from evoexp.errors import EvoexpError, SettingError, UnknownSetting, nearest
from evoexp.registry import component_class
from evoexp.validation import TARGET


def assign_all(config: dict[str, Any], overrides: Choice) -> None:
    """Apply overrides in a fixed order, whatever the order in which they were typed.

    Shorter paths come before longer ones that begin with them, deletions come last and from behind.

    Args:
        config: Changed in place.
        overrides: By dotted path, each with one value; none is a group.

    Raises:
        SettingError: If a path leads nowhere, or a value cannot be added or deleted there.
    """
    by_path = sorted(overrides.values(), key=lambda override: _parts(override.key))
    for override in by_path:
        if override.prefix != DELETE:
            _assign(config, override)
    for override in reversed(by_path):
        if override.prefix == DELETE:
            _delete(config, override)


def known_instead(config: dict[str, Any], override: Override) -> list[str] | None:
    """Return the settings of a component that lacks an overridden one; None if it has that one.

    A component that reads files, and all that is no component, is not looked into: whether there is
    such a setting is checked with its value.

    Returns:
        None if the override concerns this configuration; no names if no option of the override's
        group is chosen.
    """
    root, *parts = override.key.split(".")
    if root in NOT_IDENTITY or root not in groups() or not parts:
        return None
    if override.prefix in (ADD, FORCE):  # it adds what there is not
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


def _assign(config: dict[str, Any], override: Override) -> None:
    *parents, last = override.key.split(".")
    node: Any = config
    for k, part in enumerate(parents):
        inner = _child(node, override, k)
        if inner is None:
            inner = node[part] = {}  # whether there is such a setting is checked with its value
        node = inner
    present = _child(node, override, len(parents))
    value = override.values[0].data
    if isinstance(present, dict) and isinstance(value, dict):
        _merge(present, value)
    elif present is not None and override.prefix == ADD:
        raise SettingError(override.key, "given without +, it is there already", override.typed)
    elif isinstance(node, list) and int(last) == len(node):
        node.append(value)
    elif isinstance(node, list):
        node[int(last)] = value
    else:
        node[last] = value


def _delete(config: dict[str, Any], override: Override) -> None:
    *parents, last = override.key.split(".")
    node: Any = config
    for k in range(len(parents)):
        node = _child(node, override, k)
        if node is None:
            break
    if node is None or (isinstance(node, dict) and last not in node):
        raise SettingError(override.key, "a setting that is there, to be deleted", override.text)
    present = _child(node, override, len(parents))
    if override.values and override.values[0].data != present:
        raise SettingError(override.key, f"{present!r}, to be deleted by ~", override.typed)
    del node[int(last) if isinstance(node, list) else last]


def _child(node: Any, override: Override, depth: int) -> Any:
    """Return the value one step down a path; None where a mapping has no such key.

    Args:
        node: Where the first `depth` parts of the path lead.
        override: Gives the path, and whether a list may grow.
        depth: Number of the step, from 0.
    """
    parts = override.key.split(".")
    part, field = parts[depth], ".".join(parts[: depth + 1])
    if isinstance(node, list):
        grows = depth == len(parts) - 1 and override.prefix in (ADD, FORCE)
        if not part.isdecimal() or int(part) >= len(node) + grows:
            raise SettingError(field, _index(len(node), field.rpartition(".")[0]), part)
        return node[int(part)] if int(part) < len(node) else None
    if not isinstance(node, dict):
        above = ".".join(parts[:depth])
        if isinstance(node, str) and node.startswith("${"):
            group = node[2:].rstrip("}")
            must = f"given as {'.'.join([group, *parts[depth:]])}, the group that {above} is from"
            raise SettingError(override.key, must, override.typed)
        raise SettingError(field, f"left out: {above} is one value, {node!r}", override.typed)
    if depth == 0 and part not in node and not override.prefix:
        if part in groups():
            raise SettingError(part, f"chosen: {', '.join(options(part))}", None)
        raise UnknownSetting(part, [*groups(), *SCALARS, *_in_groups(part, node)])
    return node.get(part)


def _in_groups(name: str, config: dict[str, Any]) -> list[str]:
    """Return the setting of a group that was perhaps meant by a name given without its group."""
    if nearest(name, config):
        return []
    settings = {
        key: f"{group}.{key}"
        for group, node in config.items()
        if isinstance(node, dict)
        for key in node
        if key != TARGET
    }
    return [settings[near] for near in difflib.get_close_matches(name, settings, n=1, cutoff=0.8)]


def _index(length: int, above: str) -> str:
    if not length:
        return f"added with +{above}.0: the list is empty"
    more = f" (+{above}.{length}=… adds one)"
    return f"an index from 0 to {length - 1}{more}" if length > 1 else f"the index 0{more}"


def _merge(present: dict[str, Any], value: dict[str, Any]) -> None:
    for key, item in value.items():
        inner = present.get(key)
        if isinstance(inner, dict) and isinstance(item, dict):
            _merge(inner, item)
        else:
            present[key] = item
