"""Refusals: errors of the composer, each turned into one line that names a field and a remedy."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from evoexp.configuration.search_path import EXPERIMENT, groups, options
from evoexp.errors import EvoexpError, SettingError, UnknownOption
from evoexp.shipped import Option

HEADER = "# @package _global_"  # first line of an experiment file


def chosen(group: str) -> str:
    """Return the requirement that an option of a group is chosen, with the options."""
    if group == EXPERIMENT:
        return f"chosen: experiment=NAME, one of {len(options(group))}: evoexp list"
    return f"chosen: {', '.join(options(group))}"


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
    """Return the refusal of options that cannot be composed.

    Args:
        choices: Group → option, as far as the command line and an entry choose.
    """
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
    """Return the refusal of an experiment file; None if nothing in itself is wrong with it."""
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
