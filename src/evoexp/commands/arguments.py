"""Arguments that several commands share."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

MOTION_ENDINGS = (".json", ".npy", ".csv", ".yaml", ".yml")


def add_experiment_arguments(parser: argparse.ArgumentParser) -> argparse.Action:
    """Add the arguments that choose conditions; return that of the overrides."""
    add_config_dir_argument(parser)
    words = parser.add_argument(
        "overrides",
        nargs="*",
        metavar="KEY=VALUE",
        help="experiment=NAME, budget=paper|quick|smoke, num_replicates=N, and any setting: "
        "ga.population_size=20",
    )
    swept = "sweep over values with commas: ga.num_elites=0,2"
    parser.add_argument("-m", "--multirun", action="store_true", help=swept)
    parser.add_argument(
        "--only", type=_labels, default=(), metavar="LABEL,...", help="only these conditions"
    )
    return words


def folder_words(config_dir: Sequence[str]) -> list[str]:
    """Return the words that give the same folders of options when a command is typed again."""
    return [word for folder in config_dir for word in ("--config-dir", folder)]


def is_override(word: str) -> bool:
    """Return whether a word of a command changes a configuration: `a.b=c`, `+a.b=c`, `~a.b`.

    A file of such a name, if there is one, is a file.
    """
    return ("=" in word or word.startswith(("~", "+"))) and not Path(word).exists()


def is_motion(word: str) -> bool:
    """Return whether a word of a command is the name of a motion file."""
    return word.endswith(MOTION_ENDINGS) and not is_override(word)


def add_config_dir_argument(parser: argparse.ArgumentParser) -> None:
    """Add `--config-dir DIR`, which may be repeated; `cli.main` has the folders searched first."""
    parser.add_argument(
        "--config-dir",
        action="append",
        default=[],
        metavar="DIR",
        help="a folder of options that is searched before all others (may be repeated)",
    )


def add_json_argument(parser: argparse.ArgumentParser, content: str) -> None:
    """Add `--json`, which prints the content as JSON instead of tables."""
    parser.add_argument("--json", action="store_true", help=f"print JSON: {content}")


def _labels(text: str) -> tuple[str, ...]:
    """Split labels at their commas, but for those inside brackets: `q=[0,1]` is one label."""
    labels = map(str.strip, re.split(r",(?![^\[\](){}]*[\])}])", text))
    if named := tuple(filter(None, labels)):
        return named
    raise argparse.ArgumentTypeError(f"must name a condition, was '{text}'")
