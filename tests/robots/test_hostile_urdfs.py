"""A URDF made to harm is refused in one line, or is a robot; no other files travel with it."""

import copy
import json
import random
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from confinement import confined
from evoexp.condition import Condition
from evoexp.configuration.building import build_condition
from evoexp.testing import conditions
from hostile_data import refusal
from matrix import counts, matrices_are_asked_for
from robots.robot_samples import REACH, UR5_LIKE

NUM_URDFS = counts(1000, 10_000) if matrices_are_asked_for() else 40
MEMORY = 1500  # [MiB] beyond what the process has
NUMBERS = (
    *("nan", "inf", "-inf", "1e400", "1e308", "-1e308", "1e30", "1e9", "1e-320", "0", "-1", ""),
    *("x", "0x10", "1,5", "1 2", "9" * 400, "\u0661", "1e", "--1"),
)
TEXTS = (
    *("", "x", "../../../etc/passwd", "file:///etc/passwd", "package:///etc/passwd", "λ" * 50),
    *("package://../../../../etc/passwd", "hand.obj", "world", "base_link", "a" * 5000, "\x1b[31m"),
    *("continuous", "floating", "planar", "prismatic", "fixed", "&lt;script&gt;", "tool0"),
    "/dev/zero",
)
WHOLE = (UR5_LIKE / "ur5_like.urdf").read_text()


def without_revisions(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: without_revisions(v) for k, v in value.items() if k != "revision"}
    return [without_revisions(v) for v in value] if isinstance(value, list) else value


@pytest.fixture(scope="module")
def config() -> dict[str, Any]:
    """Return what a condition is built of: that of the intact URDF, which can be prepared."""
    (condition,) = conditions(f"robot.path={UR5_LIKE / 'ur5_like.urdf'}", *REACH).values()
    condition.prepare()
    whole = json.loads(condition.to_json())
    return without_revisions({key: whole[key] for key in ("scenario", "planner")})


def refusal_of(config: dict[str, Any], path: Path) -> str:
    """Return the refusal of a URDF, an empty text if it is a robot that can be prepared."""
    whole = copy.deepcopy(config) | {"robot": {"_target_": "urdf", "path": str(path)}, "seed": 1}
    return refusal(lambda: Condition.from_json(build_condition(whole, "").to_json()).prepare())


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
LINK = '<link name="l{0}"/><joint name="j{0}" type="fixed"><parent link="l{0}"/>'
LINK += '<child link="l{1}"/></joint>'
CHAIN = "".join(LINK.format(k, k + 1) for k in range(5000))
PASSWD = '<!ENTITY x SYSTEM "file:///etc/passwd">'
HOSTILE: dict[str, tuple[str, str]] = {
    "a thousand million laughs": (
        f'<!DOCTYPE robot [<!ENTITY l0 "ha">{LAUGHS}]><robot name="&l9;"/>', "without a document"),
    "another file by its entity": (
        f'<!DOCTYPE robot [{PASSWD}]><robot name="x">&x;</robot>', "without a document type"),
    "nested deeply": ("<robot>" + "<a>" * 100_000, "nested 50 deep"),
    "many elements": ("<robot>" + "<link/>" * 200_000 + "</robot>", "of at most 100,000 elements"),
    "a long chain": (f'<robot name="x">{CHAIN}<link name="l5000"/></robot>', "at most 300 links"),
    "an unknown encoding": ('<?xml version="1.0" encoding="x-none"?><robot/>', "XML with the root"),
    "no text": ("\0\1\2", "XML with the root"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_a_text_that_unfolds_is_refused(name: str, tmp_path: Path, config: dict) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(HOSTILE[name][0])
    assert HOSTILE[name][1] in confined(lambda: refusal_of(config, path), tmp_path, MEMORY)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("package:///etc/passwd", "meshes lie in their packages"),
        ("package://x/../../../../../../../../etc/passwd", "meshes lie in their packages"),
        ("file:///etc/passwd", "files that end in .stl"),
        ("/etc/passwd", "files that end in .stl"),
        ("secret.stl", "files that end in .stl"),  # a link to another file
        ("/dev/zero", "a missing mesh"),
    ],
)
def test_no_other_file_travels_as_a_mesh(
    name: str, reason: str, tmp_path: Path, config: dict
) -> None:
    (tmp_path / "secret.stl").symlink_to("/etc/passwd")
    path = tmp_path / "arm.urdf"
    path.write_text(re.sub(r'filename="[^"]*"', f'filename="{name}"', WHOLE))
    assert reason in confined(lambda: refusal_of(config, path), tmp_path, MEMORY)


def mutated(text: str, rng: random.Random) -> str:
    """Return a URDF that is changed in one to three places."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        attributes = list(re.finditer(r'="([^"]*)"', text))
        elements = list(re.finditer(r"<(\w+)[^<>]*/>", text))
        match rng.randrange(8):
            case 0 | 1 | 2 if attributes:  # a number, or all of an attribute
                one = rng.choice(attributes)
                words = one[1].split()
                if words and re.fullmatch(r"[-+.\deE]+", words[0]):
                    words[rng.randrange(len(words))] = rng.choice(NUMBERS)
                else:
                    words = [rng.choice(TEXTS)]
                text = text[: one.start(1)] + " ".join(words) + text[one.end(1) :]
            case 3 | 4 if elements:  # an element left out, or repeated
                one = rng.choice(elements)
                text = text[: one.start()] + one[0] * rng.choice((0, 2, 21)) + text[one.end() :]
            case 5 if attributes:  # the value of another attribute
                one, other = rng.choice(attributes), rng.choice(attributes)
                text = text[: one.start(1)] + other[1] + text[one.end(1) :]
            case 6:
                a, b = sorted(rng.randrange(len(text)) for _ in range(2))
                text = rng.choice((text[:a] + text[b:], text[:a], text[:b] + text[a:]))
            case _:
                place, character = rng.randrange(len(text)), rng.choice('\0<>"&0λ')
                text = text[:place] + character + text[place + 1 :]
    return text


def test_mutated_urdfs_are_refused_in_one_line_or_prepared(tmp_path: Path, config: dict) -> None:
    def tries() -> list[str]:
        rng, found = random.Random(20), []
        for k in range(NUM_URDFS):
            path.write_text(mutated(WHOLE, rng))
            try:
                found.append(refusal_of(config, path))
            except BaseException as error:
                raise AssertionError(f"case {k}:\n{path.read_text()[:6000]}") from error
        return found

    path = tmp_path / "arm.urdf"
    shutil.copy(UR5_LIKE / "hand.obj", tmp_path)
    refusals = confined(tries, tmp_path, MEMORY)
    assert sum(map(bool, refusals)) > NUM_URDFS // 4
