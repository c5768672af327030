"""A report stands until something that it follows from changes."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from evoexp.cli import main
from evoexp.report import standing_reports
from evoexp.report.standing_reports import StandingReport, inputs_of_reports

RUN = ["run", "experiment=rana_planar", "budget=smoke", "--only", "via-point GA"]


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def standing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], StandingReport]:
    """Return what looks at a report and all that it follows from."""
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    for name in ("runs/1/replicates/0000.mcap", "reports/one/index.md", "conf/ga/mine.yaml"):
        write(tmp_path / name, name)

    def look() -> StandingReport:
        inputs = inputs_of_reports(tmp_path, [tmp_path / "conf"])
        return StandingReport(tmp_path / "reports/one", ("words",), inputs)

    return look


def test_it_stands_once_it_is_remembered(standing: Callable[[], StandingReport]) -> None:
    assert not standing().stands()
    standing().remember()
    assert standing().stands()
    assert not standing()._replace(asked=("others",)).stands()
    assert not standing()._replace(directory=standing().directory.parent / "two").stands()


CHANGES: dict[str, Callable[[Path], object]] = {
    "a log more": lambda root: write(root / "runs/1/replicates/0001.mcap", "x"),
    "another run": lambda root: write(root / "runs/2/replicates/0000.mcap", "x"),
    "a log altered": lambda root: os.utime(root / "runs/1/replicates/0000.mcap", ns=(1, 1)),
    "a log taken away": lambda root: (root / "runs/1/replicates/0000.mcap").unlink(),
    "a page altered": lambda root: write(root / "reports/one/index.md", "else"),
    "a page taken away": lambda root: (root / "reports/one/index.md").unlink(),
    "an option": lambda root: write(root / "conf/ga/mine.yaml", "else"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_it_falls_with(change: str, standing: Callable[[], StandingReport], tmp_path: Path) -> None:
    standing().remember()
    CHANGES[change](tmp_path)
    assert not standing().stands()


def test_it_falls_with_a_run_that_was_written_while_it_was_drawn(
    standing: Callable[[], StandingReport], tmp_path: Path
) -> None:
    before = standing()
    write(tmp_path / "runs/1/replicates/0001.mcap", "x")
    before.remember()
    assert not standing().stands()


def test_it_falls_with_code(
    standing: Callable[[], StandingReport], monkeypatch: pytest.MonkeyPatch
) -> None:
    standing().remember()
    monkeypatch.setattr(standing_reports, "installed_code", lambda: b"other")
    assert not standing().stands()


def test_locks_and_damaged_notes(standing: Callable[[], StandingReport], tmp_path: Path) -> None:
    standing().remember()
    write(tmp_path / "runs/1/.lock", "")
    assert standing().stands()
    standing()._path.write_bytes(b"damaged")
    assert not standing().stands()


def test_run_draws_again_only_where_it_must(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    assert main(RUN) == 0
    assert "(as it was)" not in capsys.readouterr().out
    page = next(tmp_path.glob("reports/*/index.md"))
    content, drawn = page.read_bytes(), page.stat().st_mtime_ns
    assert main(RUN) == 0
    assert "index.md (as it was)" in capsys.readouterr().out
    assert page.stat().st_mtime_ns == drawn
    page.write_bytes(b"altered")
    assert main(RUN) == 0
    assert "(as it was)" not in capsys.readouterr().out
    assert page.read_bytes() == content
