"""`evoexp completion`: a script with which the shell completes commands, options and overrides."""

import argparse
from importlib import resources
from pathlib import Path
from typing import Any

import shtab

from evoexp.commands.command_parser import whole_parser
from evoexp.configuration.search_path import groups, options
from evoexp.errors import demand

SHELLS = ("bash", "zsh")
SINGLE = ("num_replicates", "seed")  # settings of no group


def main(arguments: argparse.Namespace) -> int:
    """Print a script, or the options of a group."""
    if arguments.shell == "options":
        for name in options(arguments.group) if arguments.group in groups() else ():
            print(name)
        return 0
    demand(arguments.group is None, "completion", f"{arguments.shell} alone", arguments.group)
    print(script(arguments.shell))
    return 0


def script(shell: str) -> str:
    """Return the script of a shell."""
    parser, declared = whole_parser(with_arguments=True)
    for argument in declared:
        completed: Any = argument  # as shtab documents it, by an attribute of the argument
        if argument.dest == "config_dir":
            completed.complete = shtab.DIRECTORY
        elif argument.type is Path:
            completed.complete = shtab.FILE
        elif not argument.option_strings and argument.nargs in ("*", "+"):
            completed.complete = dict.fromkeys(SHELLS, "_evoexp_words")
    keys = " ".join(f"{name}=" for name in (*groups(), *SINGLE))
    preamble: Any = {shell: _asset(f"words.{shell}").replace("GROUPS", keys)}
    text = str(shtab.complete(parser, shell, preamble=preamble))
    return text + (_asset("no_space.bash") if shell == "bash" else "")


def _asset(name: str) -> str:
    path = resources.files("evoexp").joinpath("assets/completion", name)
    return path.read_text(encoding="utf-8")
