"""Option files that a user brings: no larger, unfolded, than a person would write."""

from collections.abc import Iterator
from pathlib import Path

import yaml

from evoexp.errors import SettingError
from evoexp.input_files import MEGABYTE, read_bounded

MAX_FILE = MEGABYTE  # the largest shipped option has 9 kB
MOST_NESTED = 50  # lists and mappings in each other
MOST_VALUES = 100_000  # once every alias (`*name`) stands for a copy of what it names


def check_file(path: Path) -> None:
    """Refuse an option file that is too large, or that unfolds to too many values.

    Whether it can be composed otherwise is not looked at.
    """
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
