"""Distances to boxes have the same bits whatever coal was asked before, in the same process."""

import subprocess
import sys

import pytest

ASK = """
import sys
import numpy as np
if "evoexp" in sys.argv: import evoexp.collision.box_support
import coal
def distance(one, two, turn, place):
    c, s = np.cos(turn), np.sin(turn)
    x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    placed = coal.Transform3s(x @ z @ x, np.array(place, dtype=float))
    return coal.distance(
        one, coal.Transform3s(), two, placed, coal.DistanceRequest(), coal.DistanceResult()
    )
box, bar, capsule = coal.Box(0.3, 0.5, 0.7), coal.Box(0.2, 0.6, 0.4), coal.Capsule(0.1, 1.0)
first = {
    "aligned": (box, bar, 0.0), "turned": (capsule, box, 0.6), "capsules": (capsule, capsule, 0.0)
}
if sys.argv[1] in first: distance(*first[sys.argv[1]], (2.0, 1.0, 0.5))
print([distance(box, bar, 0.3 * k, (1.0 + 0.1 * k, 0.3, 0.0)).hex() for k in range(5)])
print(distance(box, bar, 0.0, (1.0, 0.0, 0.0)))
"""


def run(program: str, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *words]
    return subprocess.run(command, capture_output=True, text=True, check=True)


def answers(*words: str) -> set[str]:
    return {
        run(ASK, first, *words).stdout for first in ("nothing", "aligned", "turned", "capsules")
    }


def test_coal_itself_still_depends_on_its_first_question() -> None:
    """Where coal is mended, this fails, and `box_support` can go."""
    assert len(answers()) == 2


def test_with_evoexp_no_answer_depends_on_what_was_asked_first() -> None:
    (answer,) = answers("evoexp")
    exact = float(answer.splitlines()[1])
    assert exact == pytest.approx(0.75, abs=1e-15), "boxes are not inflated"


def test_a_program_that_asked_before_is_warned() -> None:
    early = """
import coal, numpy as np
aside = coal.Transform3s(np.eye(3), np.array([2.0, 0.0, 0.0]))
box, here = coal.Box(1, 1, 1), coal.Transform3s()
coal.distance(box, here, box, aside, coal.DistanceRequest(), coal.DistanceResult())
from evoexp.collision import box_support
print(box_support.EXACT)
"""
    done = run(early)
    assert done.stdout.strip() == "False"
    assert "coal was asked about a box before evoexp" in done.stderr
