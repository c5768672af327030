"""The comments on fields and arguments as parts of the API page (an extension of griffe)."""

import ast
import re
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import griffe

FOR_TOOLS = re.compile(r"#\s*(type: ignore|noqa)[^#]*")

NAMED = re.compile(r"<(?=\w+>)")  # in `term_<name>`, which HTML would take for a tag


@cache
def source_lines(path: Path) -> list[str]:
    """Return the lines of a file."""
    return path.read_text(encoding="utf-8").splitlines()


def comment(lines: Sequence[str], first: int, last: int) -> str:
    """Return the comment on lines, counted from 1, or else the one that stands above them."""
    parts = [part for line in lines[first - 1 : last] if (part := on_line(line))]
    k = first - 2
    while not parts[:1] and k >= 0 and lines[k].lstrip().startswith("#"):
        k -= 1
    return " ".join(parts or (on_line(line) for line in lines[k + 1 : first - 1]))


def on_line(line: str) -> str:
    """Return the comment of a line, without those for tools."""
    return FOR_TOOLS.sub("", line).partition("# ")[2].strip()


def section(title: str, items: Iterable[tuple[str, str]]) -> str:
    """Return a section of a docstring, empty without items."""
    rows = "".join(f"\n    {name}: {NAMED.sub('&lt;', text)}" for name, text in items if text)
    return f"\n\n{title}:{rows}" if rows else ""


class FieldComments(griffe.Extension):
    """Shows what stands beside or above a field, an argument or a constant."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Take the comment of a constant of a module."""
        is_constant = attr.parent is not None and attr.parent.is_module
        if is_constant and attr.docstring is None and attr.lineno and attr.endlineno:
            text = comment(source_lines(Path(str(attr.filepath))), attr.lineno, attr.endlineno)
            attr.docstring = (
                griffe.Docstring(text[:1].upper() + text[1:], parent=attr) if text else None
            )

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Add the comments of fields as the section of attributes."""
        if cls.docstring is None or "Attributes:" in cls.docstring.value:
            return
        lines = source_lines(Path(str(cls.filepath)))
        fields = [
            each
            for each in cls.members.values()
            if isinstance(each, griffe.Attribute)
            and "property" not in each.labels
            and each.annotation is not None
            and not each.name.startswith("_")
        ]
        items = ((f.name, comment(lines, f.lineno or 1, f.endlineno or 1)) for f in fields)
        cls.docstring.value += section("Attributes", items)

    def on_function_instance(
        self, *, node: ast.AST | griffe.ObjectNode, func: griffe.Function, **_: Any
    ) -> None:
        """Add the comments of arguments as the section of arguments."""
        if not isinstance(node, ast.FunctionDef) or func.docstring is None:
            return
        arguments = [*node.args.args, *node.args.kwonlyargs]
        if "Args:" in func.docstring.value or len({each.lineno for each in arguments}) < 2:
            return
        lines = source_lines(Path(str(func.filepath)))
        items = ((a.arg, comment(lines, a.lineno, a.end_lineno or 1)) for a in arguments)
        func.docstring.value += section("Args", items)
