"""Pages that are kept: found as long as nothing changes that they follow from."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from evoexp.playback import kept_pages
from evoexp.playback.kept_pages import MOST, KeptPage, kept_page

NAME = "4da921ed6875-0001"


class Studio:
    """Draws a page with a number, which tells one drawing from the next."""

    def __init__(self, log: Path) -> None:
        self.log, self.title, self.asked, self.drawn = log, "title", "asked", 0

    def page(self) -> bytes:
        def draw() -> KeptPage:
            self.drawn += 1
            return KeptPage([NAME], b"page\n%d\n" % self.drawn)

        found = kept_page([(self.log, self.title)], self.asked, draw)
        assert found.names == [NAME]
        return found.content


@pytest.fixture
def studio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Studio:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kept_pages, "installed_code", lambda: b"code")
    log = tmp_path / "0001.mcap"
    log.write_bytes(b"log")
    return Studio(log)


def test_a_page_is_drawn_once(studio: Studio) -> None:
    assert studio.page() == studio.page() == b"page\n1\n"
    copy = studio.log.with_name("copy.mcap")
    copy.write_bytes(b"log")
    studio.log = copy
    assert studio.page() == b"page\n1\n", "what counts is the content, not the place"


CHANGES: dict[str, Callable[[Studio, pytest.MonkeyPatch], object]] = {
    "a log of the same size and time": lambda studio, _: rewrite(studio.log, b"LOG"),
    "a title": lambda studio, _: setattr(studio, "title", "another"),
    "a speed": lambda studio, _: setattr(studio, "asked", "another"),
    "code": lambda _, patch: patch.setattr(kept_pages, "installed_code", lambda: b"other"),
    "a library": lambda _, patch: patch.setattr(kept_pages, "version_of", lambda _: "9.9"),
    "package data": lambda studio, patch: patch.setattr(kept_pages, "_ASSETS", studio.log.parent),
    "a log that is gone": lambda studio, _: studio.log.unlink(),
}


def rewrite(path: Path, content: bytes) -> None:
    before = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


@pytest.mark.parametrize("change", CHANGES)
def test_it_is_drawn_again_after(
    change: str, studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert studio.page() == b"page\n1\n"
    CHANGES[change](studio, monkeypatch)
    assert studio.page() == b"page\n2\n"


def test_a_damaged_page_is_drawn_again(studio: Studio, tmp_path: Path) -> None:
    studio.page()
    (kept,) = (tmp_path / "cache" / "pages").iterdir()
    kept.write_bytes(kept.read_bytes().replace(b"page", b"Page"))
    assert studio.page() == b"page\n2\n"
    assert studio.page() == b"page\n2\n"


def test_a_log_written_meanwhile_is_no_other_pages(studio: Studio) -> None:
    def draw() -> KeptPage:
        studio.log.write_bytes(b"another")
        return KeptPage([NAME], b"of the old one")

    logs = [(studio.log, studio.title)]
    assert kept_page(logs, studio.asked, draw).content == b"of the old one"
    assert studio.page() == b"page\n1\n"
    studio.log.write_bytes(b"log")
    assert studio.page() == b"page\n2\n"


def test_a_page_that_cannot_be_drawn_is_not_kept(studio: Studio) -> None:
    def draw() -> KeptPage:
        raise ValueError("no motion")

    with pytest.raises(ValueError, match="no motion"):
        kept_page([(studio.log, studio.title)], studio.asked, draw)
    assert studio.page() == b"page\n1\n"


def test_only_the_newest_are_kept(studio: Studio, tmp_path: Path) -> None:
    for k in range(MOST + 3):
        studio.asked = str(k)
        studio.page()
        newest = max(
            (tmp_path / "cache" / "pages").iterdir(), key=lambda path: path.stat().st_mtime_ns
        )
        os.utime(newest, ns=(k, k))
    assert len(list((tmp_path / "cache" / "pages").iterdir())) == MOST
    studio.asked = "0"
    assert studio.page() == b"page\n%d\n" % (MOST + 4)
