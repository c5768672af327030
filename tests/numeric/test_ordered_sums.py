"""Products of small arrays do not depend on the processor's linear algebra."""

import ast
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import evoexp
from evoexp.numeric.elementary import length, matrix_product

ROOMS = ("collision", "evolution", "numeric", "objectives", "paths", "planners", "robots")
NAMES = ("dot", "einsum", "inner", "linalg", "matmul", "tensordot", "vdot")
BY_PROCESSOR = {f"np.{name}" for name in NAMES}
ROBOT = """
import sys
import numpy as np, pinocchio as pin
from evoexp.robots.kinematics import kinematic_table
rng, model = np.random.default_rng(3), pin.Model()
for k in range(40):
    axis = rng.normal(size=3)
    joint = pin.JointModelRevoluteUnaligned(axis / np.sqrt((axis * axis).sum()))
    turn = pin.Quaternion(*rng.normal(size=4)).normalized().toRotationMatrix()
    model.addJoint(k, joint, pin.SE3(turn, rng.normal(size=3)), f"joint_{k}")
table = kinematic_table(model)
arrays = (*table.chain, table.alignment, table.free)
sys.stdout.write(b"".join(array.tobytes() for array in arrays).hex())
"""


def test_products_are_those_of_numpy() -> None:
    rng = np.random.default_rng(1)
    matrix, other, vector = rng.normal(size=(5, 3)), rng.normal(size=(3, 4)), rng.normal(size=3)
    for one, two in ((matrix, other), (matrix, vector), (vector, other), (vector, vector)):
        found = matrix_product(one, two)
        assert found.shape == (one @ two).shape
        np.testing.assert_allclose(found, one @ two, rtol=1e-14, atol=1e-14)
    assert length(np.array([2.0, 3.0, 6.0])) == 7.0
    assert length(np.zeros(3)) == 0.0


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_a_robot_in_general_position_has_the_same_table_on_every_processor() -> None:
    def table(**environment: str) -> bytes:
        words = [sys.executable, "-c", ROBOT]
        return subprocess.check_output(words, env=os.environ | environment)

    assert table(OPENBLAS_CORETYPE="Prescott") == table()


@pytest.mark.parametrize("room", ROOMS)
def test_no_sum_between_seed_and_record_is_left_to_the_processor(room: str) -> None:
    for path in sorted((Path(evoexp.__file__).parent / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_named = isinstance(node, ast.Attribute) and ast.unparse(node) in BY_PROCESSOR
            assert not (isinstance(node, ast.MatMult) or is_named), (
                f"{path}: `numeric.elementary` has products and lengths"
            )
