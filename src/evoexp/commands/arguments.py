"""Words of commands: what is an override, a motion file, a list of labels."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

MOTION_ENDINGS = (".json", ".npy", ".csv", ".yaml", ".yml")


def option_words(
    multirun: bool = False, only: Sequence[str] = (), config_dir: Sequence[str] = ()
) -> list[str]:
    """Return the words that give the same options when a command is typed again."""
    folders = [word for folder in config_dir for word in ("--config-dir", folder)]
    return [*["-m"] * multirun, *(["--only", ",".join(only)] if only else []), *folders]


def is_override(word: str) -> bool:
    """Return whether a word of a command changes a configuration: `a.b=c`, `+a.b=c`, `~a.b`.

    A file of such a name, if there is one, is a file.
    """
    return ("=" in word or word.startswith(("~", "+"))) and not Path(word).exists()


def is_motion(word: str) -> bool:
    """Return whether a word of a command is the name of a motion file."""
    return word.endswith(MOTION_ENDINGS) and not is_override(word)


def labels(text: str) -> tuple[str, ...]:
    """Split labels at their commas, but for those inside brackets: `q=[0,1]` is one label."""
    parts = map(str.strip, re.split(r",(?![^\[\](){}]*[\])}])", text))
    if named := tuple(filter(None, parts)):
        return named
    raise argparse.ArgumentTypeError(f"must name a condition, was '{text}'")
