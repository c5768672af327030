"""Eight numbers as one value: vectors for kernels, on which the usual operators work.

A kernel that keeps its intermediate results in vectors keeps them in registers; the same kernel
over arrays of scratch writes and reads them between any two steps. `+ − × ÷ sqrt` and comparisons
work lane by lane and round as IEEE 754 says: each lane has the bits of the same scalar operations,
on every processor. LLVM splits a vector where registers are narrower.

Inside kernels only: `x = load(array, place)`, `y = 2.0 * x - 1.0`, `store(array, place, y)`,
`select(x < y, x, y)`. `select`, `to_bits` and `from_bits` take scalars, too, so that a function
written with them serves both.
"""

import operator
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model
from numpy.typing import NDArray

from evoexp.numeric.compilation import inlined, intrinsic

LANES = 8


class Mask(Protocol):
    """Eight truth values, of a comparison of vectors."""

    def __and__(self, other: "Mask | bool") -> "Mask": ...
    def __or__(self, other: "Mask") -> "Mask": ...


class Vector(Protocol):
    """Eight float64. This is their type for annotations; in kernels it is `vector_type`."""

    def __add__(self, other: "Vector | float") -> "Vector": ...
    def __radd__(self, other: float) -> "Vector": ...
    def __sub__(self, other: "Vector | float") -> "Vector": ...
    def __rsub__(self, other: float) -> "Vector": ...
    def __mul__(self, other: "Vector | float") -> "Vector": ...
    def __rmul__(self, other: float) -> "Vector": ...
    def __truediv__(self, other: "Vector | float") -> "Vector": ...
    def __rtruediv__(self, other: float) -> "Vector": ...
    def __lt__(self, other: "Vector | float") -> Mask: ...
    def __le__(self, other: "Vector | float") -> Mask: ...
    def __eq__(self, other: "Vector | float") -> Mask: ...  # type: ignore[override]
    def __gt__(self, other: "Vector | float") -> Mask: ...
    def __ge__(self, other: "Vector | float") -> Mask: ...


class _VectorType(types.Type):
    """numba's type of one kind of vector."""

    lanes: ir.VectorType  # LLVM's type of it

    def __init__(self, name: str, item: ir.Type) -> None:
        super().__init__(name)
        self.lanes = ir.VectorType(item, LANES)


vector_type = _VectorType("vector8", ir.DoubleType())
word_type = _VectorType("words8", ir.IntType(64))
mask_type = _VectorType("mask8", ir.IntType(1))
_DOUBLES = vector_type.lanes


@register_model(_VectorType)
class _VectorModel(models.PrimitiveModel):
    """A vector is one LLVM value wherever it stands."""

    def __init__(self, manager: Any, kind: _VectorType) -> None:
        super().__init__(manager, kind, kind.lanes)


def _spread(builder: Any, value: Any, kind: Any) -> Any:
    """Return a vector of one scalar in every lane; a vector as it is."""
    lanes = kind.lanes
    if isinstance(value.type, ir.VectorType):
        return value
    if isinstance(value, ir.Constant):
        return ir.Constant(lanes, [value.constant] * LANES)
    nothing = ir.Constant(lanes, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, nothing, order)


def _define(
    operation: Callable[..., Any],
    vector: _VectorType,
    scalar: Any,
    result: _VectorType,
    instruction: Callable[[Any, Any, Any], Any],
) -> None:
    """Define an operator for two vectors, and for a vector and a scalar on either side."""
    kinds = (vector, vector), (vector, scalar), (scalar, vector)

    class Operator(ConcreteTemplate):
        cases = [signature(result, *pair) for pair in kinds]  # noqa: RUF012 (numba reads a list)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return instruction(builder, *(_spread(builder, value, vector) for value in arguments))

    infer_global(operation)(Operator)
    for pair in kinds:
        lower_builtin(operation, *pair)(generate)


def _comparison(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, one, two: builder.fcmp_ordered(sign, one, two)


def _unequal(builder: Any, one: Any, two: Any) -> Any:
    return builder.icmp_signed("!=", one, two)


for _operation, _instruction in {
    operator.add: ir.IRBuilder.fadd,
    operator.sub: ir.IRBuilder.fsub,
    operator.mul: ir.IRBuilder.fmul,
    operator.truediv: ir.IRBuilder.fdiv,
}.items():
    _define(_operation, vector_type, types.float64, vector_type, _instruction)
for _operation, _instruction in {
    operator.add: ir.IRBuilder.add,
    operator.and_: ir.IRBuilder.and_,
    operator.xor: ir.IRBuilder.xor,
    operator.lshift: ir.IRBuilder.shl,
}.items():
    _define(_operation, word_type, types.int64, word_type, _instruction)
for _sign, _operation in {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
}.items():
    _define(_operation, vector_type, types.float64, mask_type, _comparison(_sign))
_define(operator.ne, word_type, types.int64, mask_type, _unequal)
_define(operator.and_, mask_type, types.boolean, mask_type, ir.IRBuilder.and_)
_define(operator.or_, mask_type, types.boolean, mask_type, ir.IRBuilder.or_)


def _check_array(array: Any) -> None:
    flat = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
    if not (flat and array.dtype == types.float64):
        raise TypingError(f"array must be contiguous float64 of one dimension, is {array}")


def _pointer(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    """Return the address of eight numbers in an array's memory."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [place]), _DOUBLES.as_pointer())


@intrinsic
def _load(typing_context: Any, array: Any, place: Any) -> Any:
    _check_array(array)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_pointer(context, builder, signature.args[0], *arguments))
        value.align = 8  # [B] that of a float64
        return value

    return vector_type(array, place), generate


@intrinsic
def _store(typing_context: Any, array: Any, place: Any, vector: Any) -> Any:
    _check_array(array)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, place, value = arguments
        written = builder.store(value, _pointer(context, builder, signature.args[0], array, place))
        written.align = 8
        return context.get_dummy_value()

    return types.void(array, place, vector), generate


@intrinsic
def _spread_scalar(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _spread(builder, arguments[0], vector_type)

    return vector_type(types.float64), generate  # of an int, too


@intrinsic
def _select(typing_context: Any, condition: Any, one: Any, two: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return one(condition, one, one), generate


@intrinsic
def _any_lane(typing_context: Any, mask: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = builder.bitcast(arguments[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", word, ir.Constant(word.type, 0))

    return types.boolean(mask_type), generate


def _of_llvm(name: str) -> Any:
    """Return a function for kernels: an operation of LLVM on every lane."""

    @intrinsic
    def operation(typing_context: Any, vector: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            function = cgutils.get_or_insert_function(
                builder.module,
                ir.FunctionType(_DOUBLES, [_DOUBLES]),
                f"llvm.{name}.v{LANES}f64",
            )
            return builder.call(function, arguments)

        return vector_type(vector_type), generate

    return operation


def _reinterpretation(targets: dict[Any, Any]) -> Any:
    """Return a function for kernels that reads the 64 bits of one type as another."""

    @intrinsic
    def reinterpret(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

        # a vector as it is; a scalar of another type counts as the one that is named
        source = value if value in targets else next(iter(targets))
        return signature(targets[source], source), generate

    return reinterpret


load: Callable[[NDArray[np.float64], np.uint64], Vector] = _load
"""Return eight numbers that stand side by side in a contiguous array, from an index on.

Neither `load` nor `store` checks that they lie within the array.
"""

store: Callable[[NDArray[np.float64], np.uint64, Vector], None] = _store
"""Write eight numbers side by side into a contiguous array, from an index on."""

spread: Callable[[float], Vector] = _spread_scalar
"""Return a vector of one number in every lane."""

select: Callable[[Any, Any, Any], Any] = _select
"""Return the first value in lanes where a condition holds, the second in the others."""

any_lane: Callable[[Mask], bool] = _any_lane
"""Return whether a condition holds in any lane."""

root: Callable[[Vector], Vector] = _of_llvm("sqrt")
"""Return the square root of every lane, correctly rounded."""

magnitude: Callable[[Vector], Vector] = _of_llvm("fabs")
"""Return the absolute value of every lane."""

ceiling: Callable[[Vector], Vector] = _of_llvm("ceil")
"""Return the least whole number not below the value of every lane."""

whole: Callable[[Vector], Vector] = _of_llvm("rint")
"""Return the whole number that is nearest to the value of every lane, the even one of two."""

to_bits: Callable[[Any], Any] = _reinterpretation(
    {types.float64: types.int64, vector_type: word_type}
)
"""Return the bits of a float64 as an int64, of a vector as eight of them."""

from_bits: Callable[[Any], Any] = _reinterpretation(
    {types.int64: types.float64, word_type: vector_type}
)
"""Undo `to_bits`."""


@inlined
def lower(one: Vector, two: Vector) -> Vector:
    """Return the smaller of two numbers, lane by lane; the first where either is NaN."""
    found: Vector = select(two < one, two, one)
    return found


@inlined
def upper(one: Vector, two: Vector) -> Vector:
    """Return the greater of two numbers, lane by lane; the first where either is NaN."""
    found: Vector = select(one < two, two, one)
    return found
