"""Eight small whole numbers as one value, beside the vectors of `vectors`.

What a kernel notes of eight numbers, such as which of some moves led to each, fits into a byte per
lane: an eighth of the memory of a vector, and the cost of the smallest registers. Inside kernels
only; `vectors.select` takes bytes, too.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.errors import TypingError
from numba.extending import models, register_model
from numpy.typing import NDArray

from evoexp.numeric.compilation import intrinsic
from evoexp.numeric.vectors import LANES, Mask, mask_type

_BYTE = ir.IntType(8)
_LANES = ir.VectorType(_BYTE, LANES)


class Bytes(Protocol):
    """Eight int8. This is their type for annotations."""


class _BytesType(types.Type):
    """numba's type of eight int8."""


bytes_type = _BytesType("bytes8")


@register_model(_BytesType)
class _BytesModel(models.PrimitiveModel):
    """Eight bytes are one LLVM value wherever they stand."""

    def __init__(self, manager: Any, kind: _BytesType) -> None:
        super().__init__(manager, kind, _LANES)


def _pointer(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    return builder.gep(context.make_array(kind)(context, builder, array).data, [place])


def _check_array(array: Any, dtype: Any) -> None:
    flat = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
    if not (flat and array.dtype == dtype):
        raise TypingError(f"array must be contiguous {dtype} of one dimension, is {array}")


@intrinsic
def _load_bytes(typing_context: Any, array: Any, place: Any) -> Any:
    _check_array(array, types.int8)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = _pointer(context, builder, signature.args[0], *arguments)
        value = builder.load(builder.bitcast(pointer, _LANES.as_pointer()))
        value.align = 1  # [B]
        return value

    return bytes_type(array, place), generate


@intrinsic
def _store_bytes(typing_context: Any, array: Any, place: Any, value: Any) -> Any:
    _check_array(array, types.int8)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, place, value = arguments
        pointer = _pointer(context, builder, signature.args[0], array, place)
        written = builder.store(value, builder.bitcast(pointer, _LANES.as_pointer()))
        written.align = 1  # [B]
        return context.get_dummy_value()

    return types.void(array, place, value), generate


def _spread(builder: Any, value: Any) -> Any:
    """Return a byte, the lowest of a number, in every lane."""
    nothing = ir.Constant(_LANES, ir.Undefined)
    first = builder.insert_element(
        nothing, builder.trunc(value, _BYTE), ir.Constant(ir.IntType(32), 0)
    )
    order = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, nothing, order)


@intrinsic
def _spread_byte(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _spread(builder, arguments[0])

    return bytes_type(types.int64), generate


@intrinsic
def _equal_bytes(typing_context: Any, one: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.icmp_signed("==", arguments[0], _spread(builder, arguments[1]))

    return mask_type(bytes_type, types.int64), generate


@intrinsic
def _load_mask(typing_context: Any, array: Any, place: Any) -> Any:
    _check_array(array, types.uint8)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = builder.load(_pointer(context, builder, signature.args[0], *arguments))
        return builder.bitcast(word, ir.VectorType(ir.IntType(1), LANES))

    return mask_type(array, place), generate


load_bytes: Callable[[NDArray[np.int8], np.uint64], Bytes] = _load_bytes
"""Return eight numbers that stand side by side in a contiguous array, from an index on.

As with `vectors.load`, nothing checks that they lie within the array.
"""

store_bytes: Callable[[NDArray[np.int8], np.uint64, Bytes], None] = _store_bytes
"""Write eight numbers side by side into a contiguous array, from an index on."""

spread_byte: Callable[[int], Bytes] = _spread_byte
"""Return bytes of one number, from −128 to 127, in every lane."""

equal_bytes: Callable[[Bytes, int], Mask] = _equal_bytes
"""Return where bytes are a number from −128 to 127."""

load_mask: Callable[[NDArray[np.uint8], np.uint64], Mask] = _load_mask
"""Return eight truth values from the bits of a number in a contiguous array, the lowest first."""
