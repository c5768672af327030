"""Matplotlib style files: evoexp's own, and those of users, which are applied over it."""

import functools
import logging
import warnings
from collections.abc import Mapping
from importlib import resources
from logging.handlers import BufferingHandler
from typing import Any

import matplotlib as mpl

from evoexp.errors import SettingError, brief

MOST_LINES = 10_000  # that a log keeps


@functools.cache
def own_style() -> Mapping[str, Any]:
    """Return the parameters of evoexp's own style."""
    with resources.as_file(resources.files("evoexp") / "assets/report.mplstyle") as path:
        found = mpl.rc_params_from_file(path, use_default_template=False)
    return {str(name): value for name, value in found.items()}


def read_style_file(path: str) -> dict[str, Any]:
    """Return the parameters that a matplotlib style file sets, but those that name files' ids.

    Raises:
        SettingError: If it cannot be read, or sets what matplotlib does not know.
    """
    # matplotlib logs what a style file has wrong
    logger, handler = logging.getLogger("matplotlib"), BufferingHandler(MOST_LINES)
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)
    reason = ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            style = dict(mpl.rc_params_from_file(path, use_default_template=False))
    except (OSError, ValueError, Warning) as error:
        reason = str(error)
    finally:
        logger.removeHandler(handler)
    if lines := [record.getMessage() for record in handler.buffer] or [reason] * bool(reason):
        wrong = brief(lines[0].strip().partition("\n")[0])
        raise SettingError("report.style", f"a matplotlib style file ({wrong})", path)
    return {name: value for name, value in style.items() if name != "svg.hashsalt"}
