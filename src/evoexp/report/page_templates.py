"""Templates of HTML pages: every value that is put into one is escaped."""

import functools
import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import TYPE_CHECKING, Any

from evoexp.report.page_text import Verdict

if TYPE_CHECKING:  # loaded only where a page is written
    from jinja2 import Environment
    from markdown_it import MarkdownIt
    from markupsafe import Markup

NO_VALUE = ("–", "")  # cells of a column of numbers that hold none
LONGEST_NUMBER = 48  # characters of a cell that is still a number, with its interval and unit
_NUMBER = re.compile(r"[-−]?(\d[\d.]*(e[-+−]?\d+)?|∞)($|[ \[%°])")
_HASH = re.compile("<code>([0-9a-f]{12})</code>")
_COUNT = re.compile(r"\s\(n\s=\s\d+\)")  # behind a condition in the head of a table


@functools.cache
def asset(name: str) -> str:
    """Return a file of `assets/site`: a template, the style sheet, the script."""
    path = resources.files("evoexp").joinpath("assets/site", name)
    return path.read_text(encoding="utf-8")


@functools.cache
def _environment() -> "Environment":
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(asset),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals |= {
        "is_verdict": lambda value: isinstance(value, Verdict),
        "verdict_class": verdict_class,
        "number_columns": number_columns,
    }
    return environment


def written(template: str, runs: Mapping[str, str] | None = None, **values: Any) -> bytes:
    """Return a page.

    Args:
        template: Name of its file in `assets/site`.
        runs: Hash → label of the runs that the page has a place for: codes that name a hash, and
            heads of tables that name a label, link to it.
        values: By the names that the template has for them.
    """
    from markupsafe import Markup

    known = frozenset(runs or {})
    places = {label: name for name, label in reversed(list((runs or {}).items()))}
    text = (
        _environment()
        .get_template(template)
        .render(
            inline=lambda value: inline(str(value), known),
            label=lambda value: label(str(value), known, places),
            style=Markup(asset("site.css")),
            script=Markup(asset("site.js")),
            **values,
        )
    )
    return text.lstrip("\n").encode()


def inline(text: str, hashes: frozenset[str] = frozenset()) -> "Markup":
    """Return a text as HTML: words between grave accents as code, and all else as it is.

    Args:
        text: Anybody's.
        hashes: Codes that link to the place of their run.
    """
    from markupsafe import Markup

    def linked(code: re.Match[str]) -> str:
        return f'<a href="#run-{code[1]}">{code[0]}</a>' if code[1] in hashes else code[0]

    return Markup(_HASH.sub(linked, _reader().renderInline(text)))


@functools.cache
def _reader() -> "MarkdownIt":
    """Return a reader of Markdown that knows code alone: all else in a text is as it is."""
    from markdown_it import MarkdownIt

    return MarkdownIt("zero").enable("backticks")


def label(text: str, hashes: frozenset[str], places: Mapping[str, str]) -> "Markup":
    """Return the head of a row or column as HTML: the label of a condition links to its run.

    Args:
        text: Anybody's; behind a label the number of runs may stand: "random search (n = 20)".
        hashes: As for `inline`.
        places: Label → hash.
    """
    from markupsafe import Markup

    name = places.get(_COUNT.sub("", text))
    if name is None:
        return inline(text, hashes)
    return Markup('<a href="#run-{}">{}</a>').format(name, inline(text))


def script_json(value: Any) -> "Markup":
    """Return data for a script element: nothing in it can end the element."""
    from markupsafe import Markup

    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), sort_keys=True)
    return Markup(text.replace("<", "\\u003c"))


def verdict_class(verdict: str) -> str:
    """Return the class of a verdict's badge: its first word."""
    word = re.match("[a-z]*", verdict)
    return word[0] if word else ""


def number_columns(headers: Sequence[str], rows: Sequence[Sequence[object]]) -> Mapping[int, bool]:
    """Return position → whether every cell of a column begins with a number, or has no value."""
    found = {}
    for k in range(len(headers)):
        cells = [text for row in rows if (text := str(row[k])) not in NO_VALUE]
        found[k] = bool(cells) and all(
            len(text) <= LONGEST_NUMBER and _NUMBER.match(text) for text in cells
        )
    return found
