"""The player's pages look as they did when somebody looked at them.

The pictures in `appearances` are screenshots, made small so that fonts and drivers do not matter.
`EVOEXP_NEW_APPEARANCES=1` writes them anew: look at them before they are kept.
"""

import io
import os
from collections.abc import Iterator
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from chromium import CHROMIUM, Browser
from evoexp.configuration.compose import expand
from evoexp.playback.player_page import page
from evoexp.playback.recording import Heading, Recording, record
from evoexp.records import generations
from playback_samples import SAMPLES, recording, refuted

pytestmark = [
    pytest.mark.browser,
    pytest.mark.matrix,
    pytest.mark.skipif(
        CHROMIUM is None, reason="needs chromium on PATH (Debian: apt-get install chromium)"
    ),
]

FOLDER = Path(__file__).parent / "appearances"
NEW = os.environ.get("EVOEXP_NEW_APPEARANCES") == "1"
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


def panda() -> Recording:
    """Return the motion of an arm of meshes."""
    words = ("experiment=motionbenchmaker", "budget=smoke")
    ((_, own),) = expand(words, only=("box_panda",))[0].conditions
    planner, problem = own.prepare()
    best = next(generations(planner.evolve(problem, own.rng(0)))).best
    return record(own, np.array(best), Heading("panda"))


def shown(name: str) -> Recording:
    return {"refuted": refuted, "panda": panda}.get(name, lambda: recording(name))()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


def small(png: bytes) -> np.ndarray:
    """Return a screenshot as (rows, columns, 3), each pixel the mean of a cell."""
    pixels = matplotlib.image.imread(io.BytesIO(png))[..., :3]
    rows, columns = (size // CELL for size in pixels.shape[:2])
    cells = pixels[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL, 3)
    return np.asarray(cells.mean(axis=(1, 3)))


def kept(name: str) -> np.ndarray:
    return np.asarray(matplotlib.image.imread(FOLDER / f"{name}.png")[..., :3])


def is_alike(one: np.ndarray, other: np.ndarray) -> bool:
    if one.shape != other.shape:
        return False
    away = np.abs(one - other).max(axis=2)
    return bool(away.mean() <= MEAN and (away > FAR).mean() <= SHARE)


def file_name(name: str, size: tuple[int, int], scheme: str) -> str:
    return f"{name.replace(' ', '_')}_{size[0]}_{scheme}"


@pytest.mark.parametrize(("name", "size", "scheme"), CASES, ids=lambda value: str(value))
def test_a_page_looks_as_it_did(
    browser: Browser, tmp_path: Path, name: str, size: tuple[int, int], scheme: str
) -> None:
    path = tmp_path / "page.html"
    path.write_bytes(page([shown(name)]))
    browser.look(*size, scheme)
    browser.open(path.as_uri() + "#t=0.5")
    browser.run(WITHOUT_TEXT)
    browser.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    found, own = small(browser.screenshot()), file_name(name, size, scheme)
    if NEW:
        FOLDER.mkdir(exist_ok=True)
        matplotlib.image.imsave(FOLDER / f"{own}.png", found)
    assert is_alike(found, kept(own))
    assert browser.complaints == []


def test_pages_that_differ_are_told_apart() -> None:
    pictures = {path.stem: kept(path.stem) for path in sorted(FOLDER.glob("*.png"))}
    assert pictures.keys() == {file_name(*case) for case in CASES}
    for one, first in pictures.items():
        alike = [other for other, second in pictures.items() if is_alike(first, second)]
        assert alike == [one]
