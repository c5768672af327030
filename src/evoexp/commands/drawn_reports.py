"""Reports that a command draws, each named as soon as it is there."""

from collections.abc import Callable, Sequence

from rich.console import Console

from evoexp.commands.standard_streams import complain
from evoexp.errors import EvoexpError


def name_reports(
    draws: Sequence[Callable[[], str]],
    console: Console,
    before: Callable[[int], None] = lambda number: None,
) -> int:
    """Draw reports, name each in order; return the exit code.

    One that cannot be drawn keeps no other from being drawn: one line says why.

    Args:
        draws: Each draws a report and returns its place.
        console: Prints the lines.
        before: Called with the number of each report before it is drawn.

    Raises:
        Exception: The first programming error, or error of the system, once all others are drawn.
    """
    refused, errors = False, list[Exception]()
    for number, draw in enumerate(draws):
        before(number)
        try:
            console.print(f"report: {draw()}", soft_wrap=True)
        except EvoexpError as refusal:
            refused = True
            complain(str(refusal))
        except Exception as error:
            errors.append(error)
    if errors:
        raise errors[0]
    return 2 if refused else 0
