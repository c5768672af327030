"""The player's page in a browser: it plays, says no error, and asks the network for nothing.

It looks as it did when somebody looked at it. The pictures in `appearances` are screenshots, made
small so that fonts and drivers do not matter. `EVOEXP_NEW_APPEARANCES=1` writes them anew: look at
them before they are kept.
"""

import html
import io
import json
import os
import time
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from chromium import NEEDS_BROWSER, PATIENCE, Browser
from chromium import browser as browser
from evoexp.configuration.compose import expand
from evoexp.playback.player_page import page
from evoexp.playback.recording import Heading, Recording, record
from evoexp.records import generations
from playback_samples import SAMPLES, recording, refuted

pytestmark = [*NEEDS_BROWSER, pytest.mark.matrix]

FOLDER = Path(__file__).parent / "appearances"
CELL = 10  # [px] of a screenshot that become one pixel
DESKTOP, TELEPHONE = (1200, 800), (390, 840)
CASES = [
    *((name, DESKTOP, "light") for name in [*SAMPLES, "refuted", "panda"]),
    ("two arms", DESKTOP, "dark"),
    ("postures", TELEPHONE, "light"),
]
MEAN, FAR, SHARE = 0.002, 0.08, 0.005  # most difference: on average, and of a share of the pixels
WITHOUT_TEXT = """document.head.append(Object.assign(document.createElement("style"),
  {textContent: "body * {color: transparent !important}"})), 0"""  # fonts differ
FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
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


def panda() -> Recording:
    """Return the motion of an arm of meshes."""
    words = ("experiment=motionbenchmaker", "budget=smoke")
    ((_, own),) = expand(words, only=("box_panda",))[0].conditions
    planner, problem = own.prepare()
    best = next(generations(planner.evolve(problem, own.rng(0)))).best
    return record(own, np.array(best), Heading("panda"))


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Browser:
    """Open the page of two arms, and assert at the end that nothing was complained of."""
    open_page(browser, tmp_path, [recording("two arms"), refuted()])
    yield browser
    assert browser.complaints == []


def open_page(browser: Browser, folder: Path, shown: list[Recording], moment: str = "#t=0") -> None:
    (folder / "page.html").write_bytes(page(shown))
    browser.open((folder / "page.html").as_uri() + moment)


def click(browser: Browser, name: str) -> None:
    browser.run(f"document.getElementById('{name}').click()")


def small(png: bytes) -> np.ndarray:
    """Return a screenshot as (rows, columns, 3), each pixel the mean of a cell."""
    pixels = matplotlib.image.imread(io.BytesIO(png))[..., :3]
    rows, columns = (size // CELL for size in pixels.shape[:2])
    cells = pixels[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL, 3)
    return np.asarray(cells.mean(axis=(1, 3)))


def stored(name: str) -> np.ndarray:
    return np.asarray(matplotlib.image.imread(FOLDER / f"{name}.png")[..., :3])


def is_alike(one: np.ndarray, other: np.ndarray) -> bool:
    if one.shape != other.shape:
        return False
    away = np.abs(one - other).max(axis=2)
    return bool(away.mean() <= MEAN and (away > FAR).mean() <= SHARE)


def file_name(name: str, size: tuple[int, int], scheme: str) -> str:
    return f"{name.replace(' ', '_')}_{size[0]}_{scheme}"


@pytest.mark.parametrize(("name", "size", "scheme"), CASES, ids=str)
def test_a_page_looks_as_it_did_and_its_picture_moves(
    browser: Browser, tmp_path: Path, name: str, size: tuple[int, int], scheme: str
) -> None:
    shown = {"refuted": refuted, "panda": panda}.get(name, lambda: recording(name))()
    browser.look(*size, scheme)
    open_page(browser, tmp_path, [shown], "#t=0.5")
    browser.run(WITHOUT_TEXT)
    browser.run(FRAMES)
    found, own = small(browser.screenshot()), file_name(name, size, scheme)
    if os.environ.get("EVOEXP_NEW_APPEARANCES") == "1":
        matplotlib.image.imsave(FOLDER / f"{own}.png", found)
    assert is_alike(found, stored(own))
    pictures = [browser.run(f"motionPage.jump({t}), motionPage.picture(0)") for t in (0, 0.3, 1)]
    assert all(each.startswith("data:image/png") and len(each) > 3000 for each in pictures), "blank"
    assert (pictures[0] != pictures[1]) or name == "placement"  # a posture
    assert browser.complaints == []
    own_address = (tmp_path / "page.html").as_uri()
    assert [url for url in browser.requests if not url.startswith(("data:", own_address))] == []


def test_pages_that_differ_are_told_apart() -> None:
    pictures = {path.stem: stored(path.stem) for path in sorted(FOLDER.glob("*.png"))}
    assert pictures.keys() == {file_name(*case) for case in CASES}
    for one, first in pictures.items():
        assert [other for other, second in pictures.items() if is_alike(first, second)] == [one]


def test_it_plays_and_stops(opened: Browser) -> None:
    assert opened.run("motionPage.state.playing") is False
    first = opened.screenshot()
    click(opened, "play")
    end = time.monotonic() + PATIENCE
    while opened.run("motionPage.state.share") < 0.05 and time.monotonic() < end:
        time.sleep(0.05)
    click(opened, "play")
    share = opened.run("motionPage.state.share")
    assert share >= 0.05
    assert opened.screenshot() != first
    assert opened.run("[motionPage.state.playing, motionPage.state.share]") == [False, share]
    move = "s = document.getElementById('time'); s.value = 0.5; s.dispatchEvent(new Event('input'))"
    opened.run(move)
    assert opened.run("motionPage.state.share") == 0.5
    assert opened.run("document.querySelectorAll('.motion').length") == 2
    contacts = len(refuted().clearance.contacts)
    assert opened.run("document.querySelectorAll('#track b').length") == contacts


def test_the_address_links_to_the_moment_and_is_copied(opened: Browser, tmp_path: Path) -> None:
    opened.run("document.execCommand = () => { copied = 1; return true; }, 0")
    opened.run("navigator.clipboard.writeText = text => { copied = text; return 1; }, 0")
    opened.run("motionPage.jump(0.25)")
    assert opened.run("location.hash") == "#t=0.2500"
    click(opened, "link")
    assert opened.run("copied").endswith("page.html#t=0.2500")
    open_page(opened, tmp_path, [refuted()], "#t=0.2500")
    assert opened.run("motionPage.state.share") == 0.25


def test_keys_move_and_change_the_speed(opened: Browser) -> None:
    press = "document.dispatchEvent(new KeyboardEvent('keydown', {key: '%s'}))"
    for name, share in (("End", 1.0), ("ArrowLeft", 0.99), ("Home", 0.0), ("ArrowRight", 0.01)):
        opened.run(press % name)
        assert opened.run("motionPage.state.share") == pytest.approx(share)
    for name, speed in (("ArrowUp", "2"), ("ArrowDown", "1")):
        opened.run(press % name)
        assert opened.run("document.getElementById('speed').value") == speed
    opened.run(press % " ")
    assert opened.run("motionPage.state.playing") is True


def test_within_another_page_it_waits(browser: Browser, tmp_path: Path) -> None:
    inner = html.escape(page([recording("two arms")]).decode())
    text = f'<!doctype html><html><body><iframe srcdoc="{inner}"></iframe></body></html>'
    (tmp_path / "outer.html").write_text(text)
    player = "document.querySelector('iframe').contentWindow.motionPage"
    browser.open((tmp_path / "outer.html").as_uri(), f"{player} !== undefined")
    assert browser.run(f"[{player}.state.playing, {player}.state.share]") == [False, 0]
    assert browser.complaints == []


def test_motions_side_by_side_have_one_scale(opened: Browser) -> None:
    script = "JSON.stringify(motionPage.motions.map(m => [m.radius, m.extent, m.center]))"
    one, other = json.loads(opened.run(script))
    assert one == other  # the same robots stand at the same place
    assert one[0] >= max(each.view.radius for each in (recording("two arms"), refuted()))


def test_it_plays_by_itself_and_the_bodies_that_touch_are_red(
    browser: Browser, tmp_path: Path
) -> None:
    open_page(browser, tmp_path, [refuted()], "")
    assert browser.run("motionPage.state.playing || motionPage.state.share > 0")
    contact = refuted().clearance.contacts[0]
    middle = 0.5 * (contact.begin + contact.end) / refuted().motion.num_segments
    free, touching = (
        browser.run(f"motionPage.jump({share}), {COUNT_REDS}") for share in (0.0, middle)
    )
    assert free == 0 and touching > 100
    assert browser.complaints == []
