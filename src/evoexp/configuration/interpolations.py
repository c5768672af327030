"""Interpolations: settings that are taken from others, `${ga}` or `${ga.num_generations}`."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from evoexp.errors import SettingError

MARK = "${"
_WHOLE = re.compile(r"\$\{([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)\}")
_FUNCTION = re.compile(r"\$\{[^{}]*:")
_MAX_DEPTH = 100  # of settings taken from settings; deeper ones go round in circles


class NotWhole(Exception):
    """An interpolation of another kind than the name of one setting that exists."""


def fill_in(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with the settings that they are taken from in the place of interpolations.

    This is the usual case, a hundred times faster than by OmegaConf.

    Raises:
        NotWhole: If an interpolation is more than the name of a setting that exists.
    """
    return {key: _filled(value, config, _MAX_DEPTH) for key, value in config.items()}


def _filled(value: Any, config: Mapping[str, Any], depth: int) -> Any:
    if isinstance(value, dict):
        return {key: _filled(item, config, depth) for key, item in value.items()}
    if isinstance(value, list):
        return [_filled(item, config, depth) for item in value]
    if not isinstance(value, str) or MARK not in value:
        return value
    name = _WHOLE.fullmatch(value)
    found: Any = config
    for part in name[1].split(".") if name else ():
        if not isinstance(found, dict) or part not in found:
            raise NotWhole
        found = found[part]
    if name is None or depth == 0 or found == "???":
        raise NotWhole
    return _filled(found, config, depth - 1)


def refuse_functions(config: Mapping[str, Any]) -> None:
    """Refuse interpolations that call a function, such as `${oc.env:HOME}`.

    A condition is what is written down: nothing of the environment, which may hold secrets, enters
    its hash and its logs.

    Raises:
        SettingError: Naming the first one.
    """
    for field, text in interpolations(config):
        if _FUNCTION.search(text):
            must = "a value, or the name of another setting in ${…} (no function, as oc.env is)"
            raise SettingError(field, must, text)


def interpolations(value: Any, field: str = "") -> Iterator[tuple[str, str]]:
    """Yield (dotted path, text) of every text with an interpolation."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from interpolations(item, f"{field}.{key}" if field else str(key))
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from interpolations(item, f"{field}[{k}]")
    elif isinstance(value, str) and MARK in value:
        yield field, value
