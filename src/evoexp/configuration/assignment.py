"""Assignment: overrides of settings, applied to the plain data of composed options.

A dotted path leads through mappings by their keys and through lists by indices that begin at 0:
`scenario.phases.0.contacts=[…]`. A path may lead to a setting that the option does not mention: the
component decides whether it has such a setting.
"""

import contextlib
import copy
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
            must = "given without +, it is there already"
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
    if isinstance(node, dict) and last not in node:
        raise SettingError(override.key, "a setting that is there, to be deleted", override.text)
    if override.values and override.values[0].data != present:
        raise SettingError(override.key, f"{present!r}, to be deleted by ~", override.typed)
    del node[last]


def _place(config: dict[str, Any], override: Override) -> tuple[Any, Any, Any]:
    """Return the list or mapping of an overridden setting, its index or key, its present value."""
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
            must = f"given as {'.'.join([group, *parts[depth:]])}, the group that {above} is from"
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
