"""The command line: parses words, calls one command, turns errors into one line and an exit code.

Exit codes: 0 done; 1 something the command did failed (a replicate, a comparison); 2 the command
could not be done; 130 interrupted.
"""

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from evoexp.errors import EvoexpError, nearest
from evoexp.version import __version__

COMMANDS = {
    "run": "run an experiment: its missing replicates, then its report",
    "report": "draw an experiment's figures and tables again, from outputs alone",
    "reproduce": "run stored replicates again: MATCH, or the first generation that differs",
    "evaluate": "judge a given motion by an experiment's criteria",
    "view": "write a motion as an offline page that plays it",
    "play": "write a motion as a log that plays in Foxglove",
    "export": "write a motion as a joint trajectory for a robot or MoveIt",
    "list": "list experiments and stored runs",
    "show": "show one stored run: configuration, replicates, environment",
}

WITH_WORKERS = ("run", "reproduce")


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line.

    Takes no abbreviated options, whose meaning changes when options are added.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        hint = ""
        choices = {
            text: action.choices for action in self._actions for text in action.option_strings
        }
        option = message.removeprefix("argument ").split(":")[0]
        if "invalid choice" in message and choices.get(option):
            word, known = message.split("'")[1], list(choices[option] or ())
            message = (
                f"{option}: must be one of {', '.join(known)}, was '{word}'{nearest(word, known)}"
            )
        elif "invalid choice" in message:
            word = message.split("'")[1]
            message = (
                f"no command '{word}'{nearest(word, COMMANDS)} (commands: {', '.join(COMMANDS)})"
            )
        elif "unrecognized arguments" in message:
            words = message.split(": ", 1)[1].split(" ")
            word = next((word for word in words if word.startswith("-")), words[0])
            known = [text for action in self._actions for text in action.option_strings]
            message = f"no option '{word}'{nearest(word, known)} (options: {', '.join(known)})"
        self.exit(2, f"evoexp: {message}{hint}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    parser = _Parser(
        prog="evoexp", description="A laboratory for evolutionary robot motion planning."
    )
    parser.add_argument("--version", action="version", version=f"evoexp {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    for name, summary in COMMANDS.items():
        commands.add_parser(name, help=summary, add_help=False)
    if not words:
        parser.print_help()
        return 0
    chosen = words[0] if words[0] in COMMANDS else None
    if chosen is None:
        parser.parse_args(words)
        return 0
    if arguments is None and chosen in WITH_WORKERS and not {"-h", "--help"} & set(words):
        importlib.import_module("evoexp.batch.workers").start_server()  # this process is all ours
    module = importlib.import_module(f"evoexp.commands.{'list_' if chosen == 'list' else chosen}")
    command = _Parser(
        prog=f"evoexp {chosen}", description=f"{COMMANDS[chosen][0].upper()}{COMMANDS[chosen][1:]}."
    )
    module.add_arguments(command)
    try:
        given = command.parse_intermixed_args(words[1:])
        if not getattr(given, "config_dir", ()):
            return int(module.main(given))
        from evoexp.configuration.search_path import searched_first

        with searched_first(given.config_dir):
            return int(module.main(given))
    except EvoexpError as error:
        print(f"evoexp: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(
            "evoexp: interrupted; what was finished is kept, the same command goes on from there",
            file=sys.stderr,
        )
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        if error.filename is None:
            raise
        print(f"evoexp: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
