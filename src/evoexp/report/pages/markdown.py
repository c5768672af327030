"""A page in Markdown, and its numbers as text."""

import functools
import math
import re
import string
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined

from evoexp.report.pages.page_parts import Document
from evoexp.report.statistics.inference import Interval, Spread
from evoexp.report.statistics.inference import spread as spread_of

_HTML = re.compile("<(?=[A-Za-z/!?])")  # begins an element, a comment, an address
_LINK = re.compile(r"\]\(([^)]*)\)?")
_OWN_FILE = re.compile(r"[\w.-]+\.(png|svg|pdf|csv|json|tex|html)")


@functools.cache
def asset(name: str) -> str:
    """Return a file of `assets/site`: a template, the style sheet, the script."""
    path = resources.files("evoexp").joinpath("assets/site", name)
    return path.read_text(encoding="utf-8")


@functools.cache
def environment() -> Environment:
    """Return the environment that fills in templates; it refuses a value that is missing."""
    return Environment(
        loader=FunctionLoader(asset),
        autoescape=lambda name: not (name or "").endswith(".md"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def page(document: Document) -> str:
    """Return a page as Markdown."""
    template = environment().get_template("report_page.md")
    return inert(template.render(document=document, table=table).rstrip("\n") + "\n")


def table(headers: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; bars inside of cells are escaped."""
    lines = [_row(headers), _row(["---"] * len(headers)), *(_row(row) for row in rows)]
    return "\n".join(lines) + "\n"


def inert(text: str) -> str:
    """Return a page in which no name can be more than text: no HTML, no links but to its own files.

    Labels, names of options and reasons of failures may come from anybody.
    """
    text = _HTML.sub("&lt;", text)
    return _LINK.sub(
        lambda link: link[0] if _OWN_FILE.fullmatch(link[1]) else f"]\\({link[1]})", text
    )


def number(value: float) -> str:
    """Return a number with four significant digits, whole ones with all digits, NaN as a dash."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    whole = value == round(value) and abs(value) < 1e9
    return (f"{value + 0.0:.0f}" if whole else f"{value:.4g}").replace("-", "−")  # −0.0 is 0


def filled(template: str, words: Any) -> str:
    """Fill in the words of a sentence: values by name, a mapping or a `Scope`.

    `{x!n}` is written as `number` does, `{x!w}` as a whole number, `{p!p}` as `p_value`, `{xs!d}`
    as the median of its values, `{xs!m}` as that with quartiles, `{runs!i}` as a proportion with
    its interval at the level `confidence`, its decimals behind a colon (`{runs!i:1}`). A method
    stands for what it returns: `{xs.mean:.2f}`.

    Raises:
        KeyError: If a word is missing.
    """
    return Sentence(words).vformat(template, (), words)


class Sentence(string.Formatter):
    """Reads and writes the words in braces of a sentence."""

    def __init__(self, words: Any) -> None:
        self.words = words

    def get_field(self, field_name: str, args: Any, kwargs: Any) -> Any:
        """Return the value of a dotted name."""
        value, first = super().get_field(field_name, args, kwargs)
        return (value() if "." in field_name and callable(value) else value), first

    def convert_field(self, value: Any, conversion: str | None) -> Any:
        """Return a value as the letter behind its exclamation mark asks."""
        if conversion == "i":
            return functools.partial(value.with_interval, self.words["confidence"])
        if conversion in ("d", "m"):
            values = value if isinstance(value, Spread) else spread_of(value)
            return number(values.median) if conversion == "d" else spread(values)
        if conversion == "w":
            return number(round(value) if math.isfinite(value) else value)
        if conversion in ("n", "p"):
            return (number if conversion == "n" else p_value)(float(value))
        return super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> Any:
        """Return a value as text; of a proportion with its interval the format is its decimals."""
        if isinstance(value, functools.partial):
            return value(int(format_spec or 0))
        return super().format_field(value, format_spec)


def p_value(p: float) -> str:
    """Return a p-value with two significant digits."""
    return f"{p:.2g}" if p >= 1e-4 else f"{p:.1e}".replace("-", "−")


def percent(interval: Interval) -> str:
    """Return an interval of a proportion in percent."""
    return f"{100 * interval.low:.0f}–{100 * interval.high:.0f} %"


def spread(values: Spread) -> str:
    """Return a median with its quartiles; a single value as it is."""
    if not values.num_values:
        return "–"
    if values.num_values == 1:
        return number(values.median)
    return f"{number(values.median)} [{number(values.lower)}, {number(values.upper)}]"


def _row(cells: Sequence[object]) -> str:
    return (
        "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
    )
