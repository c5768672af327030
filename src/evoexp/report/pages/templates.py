"""The templates of pages, in `assets/site`: HTML, in which all values are escaped, and Markdown."""

import functools
from importlib import resources

from jinja2 import Environment, FunctionLoader, StrictUndefined


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
