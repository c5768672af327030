"""A URDF made to harm is refused in one line, or is a robot; no other files travel with it."""

import random
import re
import shutil
from pathlib import Path

import pytest

from confinement import confined, no_longer
from evoexp.condition import Condition
from evoexp.configuration.building import build_condition
from evoexp.errors import EvoexpError
from evoexp.mesh_files import MESHES
from evoexp.testing import conditions
from matrix import counts, matrices_are_asked_for

DATA = Path(__file__).parent / "data" / "ur5_like"
NUM_URDFS = counts(1000, 10_000) if matrices_are_asked_for() else 40
MEMORY = 1500  # [MiB] beyond what the process has
WORDS = (
    "robot=urdf",
    "scenario=urdf_reach",
    "planner=posture_es",
    "ga=corsepius",
    "objective=corsepius_reach",
    "collision=corsepius_spheres",
)
NUMBERS = (
    *("nan", "inf", "-inf", "1e400", "1e308", "-1e308", "1e30", "1e9", "1e-320", "0", "-1", ""),
    *("x", "0x10", "1,5", "1 2", "9" * 400, "\u0661", "1e", "--1"),
)
TEXTS = (
    *("", "x", "../../../etc/passwd", "file:///etc/passwd", "package:///etc/passwd", "λ" * 50),
    *("package://../../../../etc/passwd", "hand.obj", "world", "base_link", "a" * 5000, "\x1b[31m"),
    *(
        "continuous",
        "floating",
        "planar",
        "prismatic",
        "fixed",
        "&lt;script&gt;",
        "tool0",
        "/dev/zero",
    ),
)


@pytest.fixture(scope="module")
def config() -> dict:  # type: ignore[type-arg]
    """Return the canonical form of the condition of an intact URDF, but for its robot."""
    import json

    path = DATA / "ur5_like.urdf"
    (condition,) = conditions(f"robot.path={path}", *WORDS).values()
    condition.prepare()
    found: dict[str, object] = json.loads(condition.to_json())
    return found


def refusal(config: dict, path: Path) -> str:  # type: ignore[type-arg]
    """Return the refusal of a URDF, an empty text if it is a robot that can be prepared."""
    robot = {"_target_": "urdf", "path": str(path)}
    whole = config | {"robot": robot}
    plain = {key: value for key, value in whole.items() if key in ("robot", "scenario", "planner")}
    try:
        with no_longer():
            built = build_condition(_without_revisions(plain) | {"seed": 1}, "")
            Condition.from_json(built.to_json()).prepare()
    except EvoexpError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1500, text
        return text
    return ""


def _without_revisions(value):  # type: ignore[no-untyped-def]
    if isinstance(value, dict):
        return {k: _without_revisions(v) for k, v in value.items() if k != "revision"}
    return [_without_revisions(v) for v in value] if isinstance(value, list) else value


def whole() -> str:
    """Return the intact URDF."""
    return (DATA / "ur5_like.urdf").read_text()


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
CHAIN = "".join(
    f'<link name="l{k}"/><joint name="j{k}" type="fixed"><parent link="l{k}"/>'
    f'<child link="l{k + 1}"/></joint>'
    for k in range(5000)
)
HOSTILE: dict[str, tuple[str, str]] = {
    "a thousand million laughs": (
        f'<!DOCTYPE robot [<!ENTITY l0 "ha">{LAUGHS}]><robot name="&l9;"/>',
        "XML without a document type",
    ),
    "another file by its entity": (
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="x">&x;</robot>',
        "XML without a document type",
    ),
    "nested deeply": ("<robot>" + "<a>" * 100_000, "nested 50 deep"),
    "many elements": ("<robot>" + "<link/>" * 200_000 + "</robot>", "of at most 100,000 elements"),
    "a long chain": (f'<robot name="x">{CHAIN}<link name="l5000"/></robot>', "at most 300 links"),
    "an unknown encoding": ('<?xml version="1.0" encoding="x-none"?><robot/>', "XML with the root"),
    "no text": ("\0\1\2", "XML with the root"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_text_that_unfolds_is_refused(name: str, tmp_path: Path, config: dict) -> None:  # type: ignore[type-arg]
    path = tmp_path / "arm.urdf"
    path.write_text(HOSTILE[name][0])
    assert HOSTILE[name][1] in confined(lambda: refusal(config, path), tmp_path, MEMORY)


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
    name: str,
    reason: str,
    tmp_path: Path,
    config: dict,  # type: ignore[type-arg]
) -> None:
    (tmp_path / "secret.stl").symlink_to("/etc/passwd")
    path = tmp_path / "arm.urdf"
    path.write_text(re.sub(r'filename="[^"]*"', f'filename="{name}"', whole()))
    assert reason in confined(lambda: refusal(config, path), tmp_path, MEMORY)


def test_a_mesh_that_is_damaged_is_refused(tmp_path: Path, config: dict) -> None:  # type: ignore[type-arg]
    path = tmp_path / "arm.urdf"
    for content in (b"", b"solid x", b"\0" * 80 + b"\xff\xff\xff\xff", b"v nan 0 0\nf 1 1 1\n"):
        for ending in MESHES:
            (tmp_path / f"hand{ending}").write_bytes(content)
            path.write_text(whole().replace("hand.obj", f"hand{ending}"))
            assert confined(lambda: refusal(config, path), tmp_path, MEMORY)


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
                    text = text[: one.start(1)] + " ".join(words) + text[one.end(1) :]
                else:
                    text = text[: one.start(1)] + rng.choice(TEXTS) + text[one.end(1) :]
            case 3 if elements:
                one = rng.choice(elements)
                text = text[: one.start()] + text[one.end() :]
            case 4 if elements:
                one = rng.choice(elements)
                text = text[: one.end()] + one[0] * rng.choice((1, 20)) + text[one.end() :]
            case 5 if attributes:  # the value of another attribute
                one, other = rng.choice(attributes), rng.choice(attributes)
                text = text[: one.start(1)] + other[1] + text[one.end(1) :]
            case 6:
                a, b = sorted(rng.randrange(len(text)) for _ in range(2))
                text = rng.choice((text[:a] + text[b:], text[:a], text[:b] + text[a:]))
            case _:
                place = rng.randrange(len(text))
                text = (
                    text[:place] + chr(rng.choice((0, 60, 62, 34, 38, 48, 955))) + text[place + 1 :]
                )
    return text


def test_mutated_urdfs_are_refused_in_one_line_or_prepared(tmp_path: Path, config: dict) -> None:  # type: ignore[type-arg]
    def tries() -> list[str]:
        rng, found = random.Random(20), []
        for k in range(NUM_URDFS):
            path.write_text(mutated(whole(), rng))
            try:
                found.append(refusal(config, path))
            except BaseException as error:
                raise AssertionError(f"case {k}:\n{path.read_text()[:6000]}") from error
        return found

    path = tmp_path / "arm.urdf"
    shutil.copy(DATA / "hand.obj", tmp_path)
    refusals = confined(tries, tmp_path, MEMORY)
    assert sum(map(bool, refusals)) > NUM_URDFS // 4
