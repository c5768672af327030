"""The text of a page before it is written as Markdown or HTML.

Texts are plain but for one mark: `words between grave accents` are code.
"""

from collections.abc import Sequence
from typing import NamedTuple

PICTURES = ("png", "svg")  # kinds of files that a page can show
MOST_NAMED = 4  # runs whose hashes a caption spells out


class Verdict(NamedTuple):
    """A cell of a table that holds the verdict on a claim."""

    text: str  # such as "reproduced", or "not judged (budget smoke)"

    def __str__(self) -> str:
        """Return the verdict as Markdown."""
        return f"**{self.text}**"


class Notice(NamedTuple):
    """A remark at the top of a page, of its results as a whole."""

    title: str
    text: str


class TableText(NamedTuple):
    """A table."""

    headers: tuple[str, ...]  # of its columns
    rows: tuple[tuple[object, ...], ...]  # their cells: texts, numbers, verdicts
    note: str = ""  # below it
    file: str = ""  # name of the file that holds it as LaTeX; empty: there is none


class MotionText(NamedTuple):
    """A page that plays a motion: its title and its file."""

    title: str
    file: str


class FigureText(NamedTuple):
    """A figure."""

    stem: str  # of its files
    title: str  # heading
    caption: str  # below it
    formats: tuple[str, ...]  # kinds of its pictures
    motions: tuple[MotionText, ...] = ()  # pages that play the motions that it shows

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """(kind, name) of every file: pictures, data rows, sidecar."""
        return tuple((kind, f"{self.stem}.{kind}") for kind in (*self.formats, "csv", "json"))

    def picture(self, *preferred: str) -> str:
        """Return the name of the first picture there is of these kinds; empty if there is none."""
        return next((f"{self.stem}.{kind}" for kind in preferred if kind in self.formats), "")


class Section(NamedTuple):
    """A section: one table, or figures."""

    heading: str  # above it
    introduction: str = ""  # between heading and content
    table: TableText | None = None  # its table
    figures: tuple[FigureText, ...] = ()  # its figures


class LogText(NamedTuple):
    """A replicate of a stored run: where its log is, or why there is none."""

    replicate: int  # its index
    file: str  # the log, or the file that tells why it failed, relative to the page
    result: str  # best cost and exact verdict, or "failed"


class RunText(NamedTuple):
    """A stored run that the page shows."""

    label: str  # of the condition
    condition_id: str  # full hash, 64 hex digits
    done: int  # finished replicates
    planned: int  # planned replicates
    failed: int  # failed replicates
    is_reference: bool  # whether it is a reference, which has no motion to view
    logs: tuple[LogText, ...] = ()  # of every finished or failed replicate, in order

    @property
    def hash12(self) -> str:
        """The twelve hex digits that name the run."""
        return self.condition_id[:12]


class Document(NamedTuple):
    """The whole text of a page."""

    title: str  # heading
    command: str  # that makes it
    experiment: str  # name of the experiment; empty for runs given by their hashes
    budget: str  # name of the budget; empty for runs given by their hashes
    notices: tuple[Notice, ...]  # remarks on the results as a whole
    introduction: str  # one paragraph
    sections: tuple[Section, ...]  # without empty ones
    runs: tuple[RunText, ...]  # those that it shows
    seeds: tuple[int, ...] = ()  # of their conditions, each once

    @property
    def provenance(self) -> str:
        """The sentence that tells the runs: how many, of which seeds and hashes."""
        return provenance([(run.hash12, run.done) for run in self.runs], self.seeds)

    @property
    def origin(self) -> str:
        """The sentence that names command, experiment and budget."""
        named = {"experiment": self.experiment, "budget": self.budget}
        words = [f"{kind} `{name}`" for kind, name in named.items() if name]
        return ", ".join([f"Made by `{self.command}`", *words]) + "."

    def section(self, heading: str) -> Section | None:
        """Return the section of a heading; None if there is none."""
        return next((each for each in self.sections if each.heading == heading), None)


def provenance(runs: Sequence[tuple[str, int]], seeds: Sequence[int]) -> str:
    """Return the sentence that tells whose runs something shows; empty without any.

    Args:
        runs: (hash, finished replicates) of every condition.
        seeds: Of their conditions, each once.
    """
    counts = sorted({done for _, done in runs})
    if not counts:
        return ""
    number = str(counts[0]) if len(counts) == 1 else f"{counts[0]}–{counts[-1]}"
    each = " of each condition" if len(runs) > 1 else ""
    seed = f"seed{'s' * (len(seeds) > 1)} {', '.join(map(str, seeds))}"
    names = dict.fromkeys(name for name, _ in runs)
    shown = ", ".join(f"`{name}`" for name in list(names)[:MOST_NAMED])
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"n = {number}{each}, {seed}; run{'s' * (len(names) > 1)} {shown}{more}."
