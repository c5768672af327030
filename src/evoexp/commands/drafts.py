"""Reports that are asked for, and the check of those that are there."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from evoexp.report import build
from evoexp.report.report_settings import ReportSettings
from evoexp.store.run_directory import outputs_root


class Draft(NamedTuple):
    """A report that is asked for, before it is drawn.

    Attributes:
        request: Names its conditions.
        settings: Formats and levels.
        num_replicates: Planned for every condition; None: as many as each one has.
    """

    request: build.Request
    settings: ReportSettings
    num_replicates: int | None

    def files(self) -> build.ReportFiles:
        """Draw it; nothing is written."""
        return build.derived(self.request, self.settings, outputs_root(), self.num_replicates)


def check_reports(
    reports: Iterable[build.ReportFiles], console: Console, *, others: int = 0
) -> int:
    """Compare reports with what is on disk, and name every file that is not the same.

    Args:
        reports: As they follow from the outputs.
        console: Prints one line per file, and one at the end.
        others: Reports that could not be drawn, which were named already.

    Returns:
        The exit code: 1 if a file differs, is missing or left over.
    """
    num_reports = num_files = num_wrong = 0
    for report in reports:
        wrong = list(differences(report))
        for line in wrong:
            console.print(line, soft_wrap=True)
        num_reports += 1
        num_files += len(report.files)
        num_wrong += len(wrong)
    checked = f"{num_files} files of {num_reports} report{'s' * (num_reports != 1)}"
    if num_wrong or others:
        console.print(f"check: {checked}: {num_wrong} not as they follow from the outputs")
        return 1
    console.print(f"check: {checked}: all as they follow from the outputs")
    return 0


def differences(report: build.ReportFiles) -> Iterable[str]:
    """Yield a line for every file that differs, is missing or left over."""
    directory, files = report
    for name, content in sorted(files.items()):
        try:
            stored = (directory / name).read_bytes()
        except FileNotFoundError:
            yield f"missing: {directory / name}"
            continue
        if stored != content:
            yield f"differs: {directory / name}"
    for path in left_over(report):
        yield f"left over: {path}"


def left_over(report: build.ReportFiles) -> list[Path]:
    """Return the files of a report's folder that it does not have; the home page owns no folder."""
    return build.stale_files(report) if build.INDEX in report.files else []
