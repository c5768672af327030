"""numba is loaded without libraries that kernels have no use for; they can be loaded afterwards."""

import contextlib
import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import typeof
from numba.core.errors import NumbaTypeError, TypingError

from evoexp.numeric.bare_numba import CONFIG, left_out
from evoexp.numeric.compilation import kernel

LOADED = "import sys, evoexp.numeric.compilation; print(*{'yaml', 'scipy'} & set(sys.modules)); "


def said(folder: Path, code: str) -> list[str]:
    """Return the words that a process of its own prints in a folder."""
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.run(
        command, capture_output=True, text=True, check=True, cwd=folder
    ).stdout.split()


def test_what_numba_only_looks_for_is_left_out_and_can_be_loaded_later(tmp_path: Path) -> None:
    assert said(tmp_path, LOADED + "import yaml, scipy; print(yaml.__name__)") == ["yaml"]


def test_a_file_of_numbas_settings_is_read(tmp_path: Path) -> None:
    (tmp_path / CONFIG).write_text("loop_vectorize: 0\n")
    code = LOADED + "import numba; print(numba.config.LOOP_VECTORIZE)"
    assert said(tmp_path, code) == ["yaml", "0"]


def test_modules_are_absent_for_a_while_only() -> None:
    sys.modules.pop("wave", None)
    with left_out("wave", "json"):
        assert importlib.import_module("json")
        with pytest.raises(ImportError):
            importlib.import_module("wave")
    assert importlib.import_module("wave")


def test_an_error_meanwhile_leaves_nothing_absent() -> None:
    sys.modules.pop("wave", None)
    with contextlib.suppress(ZeroDivisionError), left_out("wave"):
        raise ZeroDivisionError
    assert "wave" not in sys.modules


@kernel
def first(values: np.ndarray) -> float:
    return values[0]


def test_types_of_arrays_are_numbas_own() -> None:
    square = np.arange(16.0).reshape(4, 4)
    assert str(typeof(square)) == "array(float64, 2d, C)"
    assert str(typeof(square.T)) == "array(float64, 2d, F)"
    assert str(typeof(square[:, ::2])) == "array(float64, 2d, A)"
    square.setflags(write=False)
    assert not typeof(square).mutable and typeof(square.copy()).mutable


def test_arrays_that_kernels_do_not_take_are_refused_by_numba() -> None:
    with pytest.raises(NumbaTypeError, match="MaskedArray"):
        first(np.ma.masked_array([1.0, 2.0], [True, False]))
    with pytest.raises(TypingError, match="Unsupported array dtype"):
        first(np.zeros(2, np.longdouble))
