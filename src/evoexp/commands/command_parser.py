"""The commands by name, and the parsers that read their words."""

import argparse
import importlib
import re
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import yaml

from evoexp.commands.arguments import labels
from evoexp.errors import nearest
from evoexp.version import __version__

_TYPES: dict[str, Any] = {"int": int, "float": float, "path": Path, "labels": labels}
_DECLARED: dict[str, Any] = yaml.load(
    resources.files("evoexp").joinpath("assets/commands.yaml").read_bytes(), yaml.CSafeLoader
)
COMMANDS: dict[str, str] = {name: command["summary"] for name, command in _DECLARED.items()}
MODULES = {"list": "list_", "claims": "claim_list"}  # where a module has another name


HYDRAS_OPTIONS = {
    "--cfg": "evoexp show experiment=NAME; with --all every setting",
    "--info": "evoexp show experiment=NAME; evoexp list",
    "--resolve": "evoexp show --all experiment=NAME",
    "--package": "evoexp show --all experiment=NAME",
    "--run": "evoexp run experiment=NAME",
    "--config-name": "evoexp run experiment=NAME",
    "--config-path": "--config-dir DIR",
    "--experimental-rerun": "evoexp reproduce HASH",
    "--shell-completion": "evoexp completion bash",
    "--hydra-help": "evoexp run --help",
}
"""Option of a Hydra application → evoexp's own way."""


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
            message = f"no option '{word}': {instead}" if instead else message
        self.exit(2, f"evoexp: {message}\n")


def command_module(name: str) -> ModuleType:
    """Import the module of a command."""
    return importlib.import_module(f"evoexp.commands.{MODULES.get(name, name)}")


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
    """Declare the arguments of a command; return them."""
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
