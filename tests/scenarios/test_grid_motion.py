"""Occupancy grids: out of text, out of pictures, out of blocks; what each refusal says."""

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from evoexp.attachments import File, keep
from evoexp.errors import SettingError
from evoexp.scenarios.grid_motion import GridMotion, blocks, read_map

BASE: dict[str, Any] = {"size": (4, 3), "start": (0, 0), "goal": (3, 2), "obstacle_height": 0.5}
BASE |= {"security_margin": 0.0, "length_unit": "unit"}
TEXT = b"; a comment\n..*.  ; upper row\n+ + + +\n.#.."
SEEN = {(2, 2), (1, 0)}


def png(rows: list[list[int]]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.array(rows, dtype=np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()


PICTURE = png([[255, 255, 0, 255], [255, 255, 255, 255], [255, 0, 255, 255]])


def nodes_of(grid: np.ndarray) -> set[tuple[int, ...]]:
    return {tuple(node) for node in np.argwhere(grid).tolist()}


@pytest.mark.parametrize("content", [TEXT, PICTURE, TEXT.replace(b"\n", b"\r\n")])
def test_a_map_has_its_greatest_y_first(content: bytes) -> None:
    assert nodes_of(read_map(content, (4, 3), "scenario.map")) == SEEN


def test_a_map_in_space_has_one_block_per_z() -> None:
    grid = read_map(b"*.\n..\n\n..\n.*\n\n..\n..\n", (2, 2, 3), "scenario.map")
    assert nodes_of(grid) == {(0, 1, 0), (1, 0, 1)}


SHAPE = r"scenario\.map: must be a map of 4 × 3 nodes, as scenario\.size says, was '4 × 2'"
SIGNS = r"must be a map of \* or # \(blocked\) and \+ or \. \(free\), was 'x in row 2'"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"....\n....\n", SHAPE),
        (b"....\n..x.\n....", SIGNS),
        (b"....\n..\n....", "equally long"),
        (b"", "equally long, was 'empty'"),
        (b"\xff\xfe", "a text or a PNG"),
        (b"\x89PNG\r\n\x1a\nnothing", "a PNG that can be read"),
        (png([[255, 128, 0, 255]] * 3), r"\(blocked\) and white \(free\) pixels, was 'grey 128'"),
    ],
)
def test_what_is_no_map_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        read_map(content, (4, 3), "scenario.map")


def test_blocks_and_map_add_up() -> None:
    scenario = GridMotion(**BASE, obstacles=((1, 1, 2, 1),), map=File(sha256=keep(TEXT)))
    assert nodes_of(scenario.blocked()) == SEEN | {(1, 1), (2, 1)}
    assert scenario.bodies()[0].size == (1.0, 0.02, 0.5)
    assert scenario.bodies()[0].center == (1.5, 1.0, 0.25)


@given(st.sampled_from([(5, 6), (3, 3, 4)]), st.floats(0.0, 1.0), st.integers(0, 2**32))
def test_blocks_cover_a_set_and_nothing_else(
    shape: tuple[int, ...], share: float, seed: int
) -> None:
    nodes = np.random.default_rng(seed).random(shape) < share
    covered = np.zeros(shape, dtype=bool)
    for low, high in blocks(nodes):
        part = tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))
        assert nodes[part].all()
        covered[part] = True
    assert np.array_equal(covered, nodes)
