"""`evoexp new`: the first files of a package with a user's own planner, operator or paper."""

import argparse
import itertools
import keyword
import re
import shutil
from importlib.util import find_spec
from pathlib import Path

import evoexp
from evoexp.configuration.search_path import options
from evoexp.errors import EvoexpError, demand
from evoexp.registry import COMPONENTS, names
from evoexp.store.files import write_files

# the command that runs what was made; in the files of a kind, `my_…` stands for the name of the
# package and `My…` for the class
COMMANDS = {
    "planner": "evoexp run experiment={name} budget=smoke",
    "paper": "evoexp run experiment={name} budget=smoke",
    "operator": "evoexp run experiment=lavoie_7dof ga.crossover={name} budget=smoke",
}
# folders of a kind's files in the assets; a paper brings a planner, and files of its own after it
TEMPLATES = {"planner": ("planner",), "paper": ("planner", "paper"), "operator": ("operator",)}
GROUPS = ("experiment", "planner", "ga")  # that the package may add an option to


class PackageExists(EvoexpError):
    """A directory or an installed module that has the name of the new package."""


def main(arguments: argparse.Namespace) -> int:
    """Write the package and print the commands to type next."""
    name = arguments.name
    root = arguments.directory / name
    is_name = re.fullmatch("[a-z][a-z0-9]*(_[a-z0-9]+)*", name) and not keyword.iskeyword(name)
    must = "a word of lower-case letters, digits and _ that begins with a letter"
    demand(is_name, "NAME", must, name)
    known = {"evoexp", *names(COMPONENTS), *itertools.chain(*map(options, GROUPS))}
    demand(name not in known, "NAME", "a new name: a component or option has it already", name)
    if root.exists():
        raise PackageExists(f"{root}: is there already; choose another NAME or --directory")
    if find_spec(name) is not None:
        raise PackageExists(f"{name}: a module of this name is installed; choose another NAME")
    files: dict[Path, str] = {}
    for kind in TEMPLATES[arguments.kind]:
        template = Path(evoexp.__file__).parent / "assets" / f"new_{kind}"
        files |= {
            root / _named(path, kind, name): _named(
                (template / path).read_text("utf-8"), kind, name
            )
            for path in sorted(str(each.relative_to(template)) for each in template.rglob("*.*"))
            if "__pycache__" not in path and (template / path).is_file()
        }
    try:
        write_files({path: text.encode() for path, text in files.items()})
    except BaseException:
        shutil.rmtree(root, ignore_errors=True)  # so that the same command can be given again
        raise
    print(f"{root}: {len(files)} files")
    print(f"install it: pip install -e {root}")
    print(f"run it:     {COMMANDS[arguments.kind].format(name=name)}")
    return 0


def _named(text: str, kind: str, name: str) -> str:
    words = name.replace("_", " ").title().replace(" ", "")
    return text.replace(f"my_{kind}", name).replace(f"My{kind.title()}", words)
