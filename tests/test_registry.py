"""Registrations: names, and the modules and packages that they come from."""

import ast
from pathlib import Path

import pytest

from evoexp.registry import CLAIMS, COMPONENTS, PAGES, registrations

SOURCE = Path(__file__).parents[1] / "src" / "evoexp"


def named_classes() -> dict[str, str]:
    """Return component name → `module:class` of every class that names itself a component."""
    named = {}
    for path in SOURCE.rglob("*.py"):
        if "assets" in path.parts:  # templates of guests
            continue
        module = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ClassDef):
                continue
            for line in node.body:
                if (
                    isinstance(line, ast.AnnAssign)
                    and ast.unparse(line.target) == "component"
                    and isinstance(line.value, ast.Constant)
                ):
                    named[str(line.value.value)] = f"{module}:{node.name}"
    return named


def test_every_component_is_registered_and_nothing_else() -> None:
    registered = {each.name: each.target for each in registrations(COMPONENTS) if each.is_own}
    assert registered == named_classes()


@pytest.mark.parametrize("group", [COMPONENTS, PAGES, CLAIMS])
def test_the_module_of_a_registration_holds_what_it_names(group: str) -> None:
    own = [each for each in registrations(group) if each.is_own]
    assert own
    for each in own if group != COMPONENTS else own[:4]:
        assert each.package.startswith("evoexp ")
        if each.file is not None:
            assert each.file.is_file()
        elif hasattr(loaded := each.load(), "__module__"):
            assert each.module == loaded.__module__
        assert each.module.startswith("evoexp.")
