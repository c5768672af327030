"""The types that kernels know numpy arrays by.

numba asks of every array whether it is a masked one, and loads `numpy.ma` to ask, which takes
longer than loading a kernel.
"""

import contextlib
from typing import Any

import numpy as np
from numba.core import types
from numba.core.errors import NumbaNotImplementedError
from numba.extending import typeof_impl
from numba.np.numpy_support import from_dtype, map_layout

_type_of_any_array = typeof_impl.dispatch(np.ndarray)


def use_plain_arrays() -> None:
    """Have numba tell the types of plain arrays in this way from now on."""
    typeof_impl.register(np.ndarray, _type_of_array)


def _type_of_array(array: Any, context: Any) -> Any:
    """Return the type of an array; those that are no plain ones are left to numba."""
    if type(array) is np.ndarray:
        with contextlib.suppress(NumbaNotImplementedError):  # which numba says in its own words
            kind, layout = from_dtype(array.dtype), map_layout(array)
            return types.Array(kind, array.ndim, layout, readonly=not array.flags.writeable)
    return _type_of_any_array(array, context)
