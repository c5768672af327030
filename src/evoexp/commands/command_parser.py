"""The commands by name, and the parsers that read their words."""

import argparse
import importlib
import re
from types import ModuleType
from typing import Any, NoReturn

from evoexp.errors import nearest
from evoexp.version import __version__

COMMANDS = {
    "run": "run an experiment: its missing replicates, then its report",
    "plan": "list what a run would start: there, missing, failed, damaged; time and memory",
    "report": "draw an experiment's figures and tables again, from outputs alone",
    "site": "write the home page of all reports: papers, claims, runs, a search",
    "compare": "compare planners by their proven answers, over collision queries",
    "claims": "list the papers' claims: rule, numbers, verdict",
    "reproduce": "run stored replicates again: MATCH, or the first generation that differs",
    "verify": "check stored runs: every log whole and in its place, and the files beside",
    "diff": "compare two runs: settings, environment, results",
    "clean": "list files that no command needs, and delete them if told so",
    "pack": "write stored runs as one file, for another machine",
    "evaluate": "judge a given motion by an experiment's criteria",
    "view": "write a motion as an offline page that plays it",
    "play": "write a motion as a log that plays in Foxglove",
    "export": "write a motion as a joint trajectory for a robot or MoveIt",
    "list": "list experiments and stored runs",
    "show": "show a condition, before or after it is run: identity, origin, result, verdict",
    "new": "write a package with a planner of your own, to begin with",
    "completion": "print a script with which the shell completes commands",
}
MODULES = {"list": "list_", "claims": "claim_list"}  # where a module has another name


class CommandParser(argparse.ArgumentParser):
    """Parser that names the wrong word in one line.

    Takes no abbreviated options, whose meaning changes when options are added.
    """

    def __init__(self, **settings: Any) -> None:
        """Declare nothing but `--help` yet."""
        self.declared: list[argparse.Action] = []
        super().__init__(allow_abbrev=False, **settings)

    def add_argument(self, *names: Any, **settings: Any) -> argparse.Action:
        """Declare an argument, and remember it."""
        argument = super().add_argument(*names, **settings)
        self.declared.append(argument)
        return argument

    def error(self, message: str) -> NoReturn:
        """Exit with code 2 and one line that names the choices."""
        if choice := re.match(
            r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", message
        ):
            option, word, choices = choice.groups()
            if option == "COMMAND":
                told = f"no command '{word}'{nearest(word, COMMANDS)}"
                message = f"{told} (commands: {', '.join(COMMANDS)})"
            else:
                known = [each.strip("'") for each in choices.split(", ")]
                must = f"must be one of {', '.join(known)}"
                message = f"{option}: {must}, was '{word}'{nearest(word, known)}"
        elif message.startswith("unrecognized arguments: "):
            words = message.split(": ", 1)[1].split(" ")
            word = next((word for word in words if word.startswith("-")), words[0])
            lines = re.findall(r"^  (-.+?)(?:  |$)", self.format_help(), re.MULTILINE)
            known = re.findall(r"(?<![\w-])--?[a-z][\w-]*", "\n".join(lines))
            message = f"no option '{word}'{nearest(word, known)} (options: {', '.join(known)})"
        self.exit(2, f"evoexp: {message}\n")


def command_module(name: str) -> ModuleType:
    """Import the module of a command."""
    return importlib.import_module(f"evoexp.commands.{MODULES.get(name, name)}")


def command_parser(name: str) -> CommandParser:
    """Return the parser of one command; its module is imported."""
    summary = COMMANDS[name]
    parser = CommandParser(prog=f"evoexp {name}", description=f"{summary[0].upper()}{summary[1:]}.")
    command_module(name).add_arguments(parser)
    return parser


def whole_parser(
    *, with_arguments: bool = False
) -> tuple[argparse.ArgumentParser, list[argparse.Action]]:
    """Return the parser of all commands, if asked for with the arguments of all, and these."""
    parser = CommandParser(
        prog="evoexp", description="A laboratory for evolutionary robot motion planning."
    )
    parser.add_argument("--version", action="version", version=f"evoexp {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=CommandParser)
    declared: list[argparse.Action] = []
    for name, summary in COMMANDS.items():
        command = commands.add_parser(name, help=summary, add_help=with_arguments)
        if with_arguments:
            command_module(name).add_arguments(command)
            declared += command.declared
    return parser, declared
