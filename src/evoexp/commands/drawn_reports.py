"""Reports that a command draws, each named as soon as it and those before it are there."""

import contextlib
from collections.abc import Callable, Sequence

from rich.console import Console

from evoexp.commands.standard_streams import complain
from evoexp.errors import EvoexpError
from evoexp.report.drawing_processes import each_on_all_cores


def name_reports(
    draws: Sequence[Callable[[], str]],
    console: Console,
    before: Callable[[int], None] = lambda number: None,
) -> int:
    """Draw reports on all cores, name each in order; return the exit code.

    One that cannot be drawn keeps no other from being drawn: one line says why.

    Args:
        draws: Each draws a report and returns its place.
        console: Prints the lines.
        before: Called with the number of each report before it is named.

    Raises:
        Exception: The first programming error, or error of the system, once all others are drawn.
    """
    refused, errors = False, list[Exception]()
    with contextlib.closing(each_on_all_cores(lambda draw: draw(), draws)) as found:
        for number in range(len(draws)):
            before(number)
            drawn = next(found)
            if isinstance(drawn, EvoexpError):
                refused = True
                complain(str(drawn))
            elif isinstance(drawn, Exception):
                errors.append(drawn)
            else:
                console.print(f"report: {drawn}", soft_wrap=True)
    for error in errors[:1]:
        raise error
    return 2 if refused else 0
