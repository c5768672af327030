"""The commands by name, the parsers of their words, and which word is an override or a motion."""

import argparse
import importlib
import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import yaml

from evoexp.errors import nearest
from evoexp.version import __version__

MOTION_ENDINGS = (".json", ".npy", ".csv", ".yaml", ".yml")
_DECLARED: dict[str, Any] = yaml.load(
    resources.files("evoexp").joinpath("assets/commands.yaml").read_bytes(), yaml.CSafeLoader
)
HYDRAS_OPTIONS: dict[str, str] = _DECLARED.pop("hydras_options")
"""Option of a Hydra application → evoexp's own way."""
COMMANDS: dict[str, str] = {name: command["summary"] for name, command in _DECLARED.items()}


def option_words(arguments: argparse.Namespace) -> list[str]:
    """Return the words that give the same options when a command is typed again."""
    folders = [word for folder in arguments.config_dir for word in ("--config-dir", folder)]
    only = ["--only", ",".join(arguments.only)] if arguments.only else []
    return [*["-m"] * arguments.multirun, *only, *folders]


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


_TYPES: dict[str, Any] = {"int": int, "float": float, "path": Path, "labels": labels}


class CommandParser(argparse.ArgumentParser):
    """Parser that names the wrong word in one line."""

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
            instead = HYDRAS_OPTIONS.get(word.partition("=")[0])
            message = f"no option '{word}'{nearest(word, known)} (options: {', '.join(known)})"
            message = f"no option '{word}'; use {instead}" if instead else message
        self.exit(2, f"evoexp: {message}\n")


def command_module(name: str) -> ModuleType:
    """Import the module of a command."""
    return importlib.import_module(f"evoexp.commands.{_DECLARED[name].get('module', name)}")


def command_function(name: str) -> Callable[[argparse.Namespace], int]:
    """Return the function of a command: `main` of its module, or that of its name."""
    module = command_module(name)
    function: Callable[[argparse.Namespace], int] = getattr(module, name, None) or module.main
    return function


def command_parser(name: str) -> CommandParser:
    """Return the parser of one command; its module is imported."""
    summary = COMMANDS[name]
    parser = CommandParser(
        prog=f"evoexp {name}",
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=_DECLARED[name].get("epilog"),
        allow_abbrev=False,  # what they mean changes when options are added
    )
    _declare(parser, name)
    return parser


def whole_parser(
    *, with_arguments: bool = False
) -> tuple[argparse.ArgumentParser, list[argparse.Action]]:
    """Return the parser of all commands, if asked for with the arguments of all, and these."""
    about = "A laboratory for evolutionary robot motion planning."
    parser = CommandParser(prog="evoexp", description=about, allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"evoexp {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=CommandParser)
    declared: list[argparse.Action] = []
    for name, summary in COMMANDS.items():
        command = commands.add_parser(name, help=summary, add_help=with_arguments)
        if with_arguments:
            declared += _declare(command, name)
    return parser, declared


def _declare(parser: CommandParser, name: str) -> list[argparse.Action]:
    module, choice, declared = command_module(name), None, []

    def constant(match: re.Match[str]) -> str:
        return ", ".join(getattr(module, match[1]))

    for *names, given in _DECLARED[name]["arguments"]:
        settings = given | {"help": re.sub(r"{(\w+)}", constant, given["help"])}
        if "type" in settings:
            settings["type"] = _TYPES[settings["type"]]
        if settings.pop("is_choice", False):  # one of them at most
            choice = choice or parser.add_mutually_exclusive_group()
            declared.append(choice.add_argument(*names, **settings))
        else:
            declared.append(parser.add_argument(*names, **settings))
    return declared
