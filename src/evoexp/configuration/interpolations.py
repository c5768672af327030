"""Interpolations: settings that are taken from others, `${ga}` or `${ga.num_generations}`.

An interpolation is a whole value and names one setting. No function is called, as `${oc.env:HOME}`
would: nothing of the environment, which may hold secrets, enters a condition's hash and logs.
"""

import re
from collections.abc import Mapping
from typing import Any

from evoexp.configuration.overrides import PLANNER_PARTS
from evoexp.configuration.refusals import chosen
from evoexp.errors import SettingError

MARK = "${"
_WHOLE = re.compile(r"\$\{([A-Za-z_]\w*(?:\.\w+)*)\}")
_FUNCTION = re.compile(r"\$\{[^{}]*:")
_MAX_DEPTH = 100  # of settings taken from settings; deeper ones go round in circles


def fill_in(values: Mapping[str, Any], config: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with others in the place of interpolations."""
    return {key: _filled(value, config, str(key), _MAX_DEPTH) for key, value in values.items()}


def _filled(value: Any, config: Mapping[str, Any], field: str, depth: int) -> Any:
    if isinstance(value, dict):
        return {k: _filled(v, config, f"{field}.{k}", depth) for k, v in value.items()}
    if isinstance(value, list):
        return [_filled(v, config, f"{field}[{k}]", depth) for k, v in enumerate(value)]
    if not isinstance(value, str) or MARK not in value:
        return value
    name = _WHOLE.fullmatch(value)
    if name is None:
        is_function = _FUNCTION.search(value)
        reason = "no function, as oc.env is" if is_function else "it cannot be read"
        raise _refusal(field, reason, value)
    if depth == 0:
        raise _refusal(field, "it leads round in a circle", value)
    setting: Any = config
    for part in name[1].split("."):
        if isinstance(setting, list) and part.isdecimal() and int(part) < len(setting):
            setting = setting[int(part)]
        elif isinstance(setting, dict) and part in setting:
            setting = setting[part]
        elif name[1] in PLANNER_PARTS:
            raise SettingError(name[1], chosen(name[1]), None)
        else:
            raise _refusal(field, f"there is no '{name[1]}'", value)
    return _filled(setting, config, field, depth - 1)


def _refusal(field: str, reason: str, text: str) -> SettingError:
    must = f"a value, or the name of another setting in ${{…}} ({reason})"
    return SettingError(field, must, text)
