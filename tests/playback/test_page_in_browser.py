"""The page in a browser: it plays, says no error, and asks the network for nothing."""

import html
import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from chromium import CHROMIUM, PATIENCE, Browser
from evoexp.playback.player_page import page
from playback_samples import SAMPLES, recording, refuted

pytestmark = [
    pytest.mark.browser,
    pytest.mark.matrix,
    pytest.mark.skipif(
        CHROMIUM is None, reason="needs chromium on PATH (Debian: apt-get install chromium)"
    ),
]


COUNT_REDS = """(() => {
  motionPage.picture(0);
  const from = document.querySelector(".stage canvas"), to = document.createElement("canvas");
  const pen = to.getContext("2d");
  to.width = from.width; to.height = from.height;
  motionPage.picture(0); pen.drawImage(from, 0, 0);
  const d = pen.getImageData(0, 0, to.width, to.height).data;
  let count = 0;
  for (let k = 0; k < d.length; k += 4) count += d[k] > 180 && d[k + 1] < 60 && d[k + 2] < 60;
  return count;
})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


def opened(browser: Browser, path: Path, content: bytes, fragment: str = "#t=0") -> None:
    path.write_bytes(content)
    browser.open(path.as_uri() + fragment)


def click(browser: Browser, name: str) -> None:
    browser.run(f"document.getElementById('{name}').click()")


@pytest.mark.parametrize("name", [*sorted(SAMPLES), "refuted"])
def test_a_page_shows_its_motion(browser: Browser, tmp_path: Path, name: str) -> None:
    path = tmp_path / "page.html"
    shown = refuted() if name == "refuted" else recording(name)
    opened(browser, path, page([shown]))
    pictures = []
    for share in (0.0, 0.3, 1.0):
        pictures.append(browser.run(f"motionPage.jump({share}), motionPage.picture(0)"))
    assert all(
        picture.startswith("data:image/png") and len(picture) > 3000 for picture in pictures
    ), "blank"
    if name != "placement":  # a posture
        assert pictures[0] != pictures[1]
    assert browser.complaints == []
    assert [url for url in browser.requests if not url.startswith(("data:", path.as_uri()))] == []


def test_it_plays_and_stops(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path / "page.html", page([recording("two arms"), refuted()]))
    assert browser.run("motionPage.state.playing") is False
    first = browser.screenshot()
    click(browser, "play")
    end = time.monotonic() + PATIENCE
    while browser.run("motionPage.state.share") < 0.05 and time.monotonic() < end:
        time.sleep(0.05)
    click(browser, "play")
    share = browser.run("motionPage.state.share")
    assert share >= 0.05
    assert browser.screenshot() != first
    assert browser.run("motionPage.state.playing") is False
    assert browser.run("motionPage.state.share") == share
    browser.run(
        "s = document.getElementById('time'); s.value = 0.5; s.dispatchEvent(new Event('input'))"
    )
    assert browser.run("motionPage.state.share") == 0.5
    assert browser.run("document.querySelectorAll('.motion').length") == 2
    assert browser.run("document.querySelectorAll('#track b').length") == len(
        refuted().clearance.contacts
    )
    assert browser.complaints == []


def test_the_address_links_to_the_moment(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path / "page.html", page([refuted()]))
    browser.run("motionPage.jump(0.25)")
    assert browser.run("location.hash") == "#t=0.2500"
    opened(browser, tmp_path / "page.html", page([refuted()]), fragment="#t=0.2500")
    assert browser.run("motionPage.state.share") == 0.25
    assert browser.complaints == []


def test_keys_move_and_change_the_speed(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path / "page.html", page([recording("two arms")]))
    press = "document.dispatchEvent(new KeyboardEvent('keydown', {key: '%s'}))"
    for name, share in (("End", 1.0), ("ArrowLeft", 0.99), ("Home", 0.0), ("ArrowRight", 0.01)):
        browser.run(press % name)
        assert browser.run("motionPage.state.share") == pytest.approx(share)
    for name, speed in (("ArrowUp", "2"), ("ArrowDown", "1")):
        browser.run(press % name)
        assert browser.run("document.getElementById('speed').value") == speed
    browser.run(press % " ")
    assert browser.run("motionPage.state.playing") is True
    assert browser.complaints == []


def test_a_link_to_the_moment_is_copied(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path / "page.html", page([recording("two arms")]))
    browser.run(
        "motionPage.jump(0.3), document.execCommand = () => { copied = 1; return true; }, 0"
    )
    browser.run("navigator.clipboard.writeText = text => { copied = text; return 1; }, 0")
    click(browser, "link")
    assert browser.run("copied").endswith("page.html#t=0.3000")


def test_within_another_page_it_waits(browser: Browser, tmp_path: Path) -> None:
    inner = html.escape(page([recording("two arms")]).decode())
    text = f'<!doctype html><html><body><iframe srcdoc="{inner}"></iframe></body></html>'
    (tmp_path / "outer.html").write_text(text)
    ready = "document.querySelector('iframe').contentWindow.motionPage !== undefined"
    browser.open((tmp_path / "outer.html").as_uri(), ready)
    state = "document.querySelector('iframe').contentWindow.motionPage.state"
    assert browser.run(f"[{state}.playing, {state}.share]") == [False, 0]
    assert browser.complaints == []


def test_motions_side_by_side_have_one_scale(browser: Browser, tmp_path: Path) -> None:
    shown = [recording("two arms"), refuted()]
    sizes = {each.view.radius for each in shown}
    opened(browser, tmp_path / "page.html", page(shown))
    found = browser.run("JSON.stringify(motionPage.motions.map(m => [m.radius, m.extent]))")
    one, other = json.loads(found)
    assert one == other
    assert one[0] >= max(sizes)
    centres = browser.run("JSON.stringify(motionPage.motions.map(m => m.center))")
    assert len(set(map(tuple, json.loads(centres)))) == 1  # the same robots stand at the same place


def test_it_plays_by_itself_and_the_bodies_that_touch_are_red(
    browser: Browser, tmp_path: Path
) -> None:
    opened(browser, tmp_path / "page.html", page([refuted()]), fragment="")
    assert browser.run("motionPage.state.playing || motionPage.state.share > 0")
    contact = refuted().clearance.contacts[0]
    middle = 0.5 * (contact.begin + contact.end) / refuted().motion.num_segments
    reds = []
    for share in (0.0, middle):
        browser.run(f"motionPage.jump({share})")
        reds.append(browser.run(COUNT_REDS))
    assert reds[0] == 0
    assert reds[1] > 100
    assert browser.complaints == []
