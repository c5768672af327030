"""Refusals: errors of the composer, each turned into one line that names a field and a remedy."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from evoexp.configuration.search_path import EXPERIMENT, groups, options
from evoexp.errors import EvoexpError, SettingError, UnknownOption
from evoexp.input_files import MEGABYTE, read_bounded
from evoexp.shipped import Option

HEADER = "# @package _global_"  # first line of an experiment file
# of an option file, no larger, unfolded, than a person would write
MAX_FILE = MEGABYTE  # the largest shipped option has 9 kB
MOST_NESTED = 50  # lists and mappings in each other
MOST_VALUES = 100_000  # once every alias (`*name`) stands for a copy of what it names


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
    """Return the refusal of options (by group, as far as they were chosen) that do not compose."""
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


def check_file(path: Path) -> None:
    """Refuse an option file that is too large, or that unfolds to too many values."""
    try:
        content = read_bounded(path, MAX_FILE)
        unfolded = _num_values(yaml.parse(content, yaml.CSafeLoader))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError("option", f"a file that can be read ({reason})", str(path)) from None
    except (yaml.YAMLError, ValueError, RecursionError):
        return  # told by whoever reads it, if anybody does
    if unfolded > MOST_VALUES:
        must = f"a file of at most {MOST_VALUES:,} values, aliases unfolded, {MOST_NESTED} deep"
        raise SettingError("option", must, str(path))


def _num_values(events: Iterator[yaml.Event]) -> int:
    """Return how many values there are, aliases unfolded; very many if they are nested deeply."""
    sizes: dict[str, int] = {}  # of what has a name
    total, open_nodes = 0, list[tuple[str | None, int]]()  # (name, values before it)
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            total += sizes.get(event.anchor, MOST_VALUES)  # what is open yet would hold itself
        elif isinstance(event, yaml.CollectionStartEvent):
            open_nodes.append((event.anchor, total))
            if len(open_nodes) > MOST_NESTED:
                return MOST_VALUES + 1
            total += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            name, before = open_nodes.pop()
            if name is not None:
                sizes[name] = total - before
        elif isinstance(event, yaml.ScalarEvent):
            total += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
    return total
