"""Tables that break no word: where a terminal is too narrow for their columns, rows are stacked."""

from collections.abc import Sequence

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text


class WordTable(Table):
    """A table as wide as its words need.

    If its columns do not fit beside each other, it loses its lines; if they still do not, every row
    is shown as a list of names and values.

    Attributes:
        gap: Columns between cells where the table has no lines.
    """

    gap = 1

    def fits(self, console: Console) -> bool:
        """Return whether its columns, without lines, fit beside each other on a console."""
        ranges = [_range(column, console, console.options) for column in self.columns]
        return self._bare(ranges) <= console.width

    def _bare(self, ranges: Sequence[Measurement]) -> int:
        """Return the least width without lines."""
        return sum(size.minimum for size in ranges) + self.gap * (len(ranges) - 1)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render it for a width."""
        room = options.max_width
        ranges = [_range(column, console, options) for column in self.columns]
        least = sum(size.minimum for size in ranges)
        if self.columns and (self.box is None or least + _lines(ranges) > room):
            if self._bare(ranges) > room:
                yield from _stacked(self)
                return
            self.box, self.padding, self.pad_edge = None, (0, self.gap, 0, 0), False
        lines = _lines(ranges) if self.box else self.gap * (len(ranges) - 1)
        for column, width in zip(self.columns, _widths(ranges, room - lines), strict=True):
            column.width = width
        yield from super().__rich_console__(console, options)


def _lines(ranges: Sequence[Measurement]) -> int:
    """Return the columns that lines and the room beside them take."""
    return 3 * len(ranges) + 1


def _range(column: Column, console: Console, options: ConsoleOptions) -> Measurement:
    """Return the widths of a column at which no word is broken, and no line."""
    wide = options.update(width=10_000)
    sizes = [Measurement.get(console, wide, cell) for cell in (column.header, *column._cells)]
    most = max(size.maximum for size in sizes)
    least = most if column.no_wrap else max(size.minimum for size in sizes)
    return Measurement(max(least, column.min_width or 0), max(most, column.min_width or 0))


def _widths(ranges: Sequence[Measurement], room: int) -> list[int]:
    """Share room among columns: first their words, then small wishes before great ones."""
    widths = [size.minimum for size in ranges]
    wishes = sorted((size.maximum - size.minimum, k) for k, size in enumerate(ranges))
    spare = room - sum(widths)
    for place, (wish, k) in enumerate(wishes):
        given = min(wish, spare // (len(wishes) - place))
        widths[k], spare = widths[k] + given, spare - given
    return widths


def _stacked(table: Table) -> RenderResult:
    """Yield the rows one below the other, each as its headers and cells."""
    if table.title:
        yield Text.from_markup(table.title) if isinstance(table.title, str) else table.title
    names = [_flat(column.header) for column in table.columns]
    for cells in zip(*(column._cells for column in table.columns), strict=True):
        row = Table.grid(Column(no_wrap=True), Column(overflow="fold"), padding=(0, 2, 0, 0))
        for name, cell in zip(names, cells, strict=True):
            row.add_row(name, cell)
        yield row
        yield Text()


def _flat(header: RenderableType) -> str:
    """Return a header on one line."""
    return " ".join(str(header).split())
