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
from typing import Any, TypeAlias

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from evoexp.numeric.compilation import inlined, intrinsic

LANES = 8


# eight float64, and eight truth values of a comparison: numba knows them as `vector_type` and
# `mask_type`, and checks their use when it compiles a kernel; a `Number` is a float or a vector
Vector: TypeAlias = Any
Mask: TypeAlias = Any
Number: TypeAlias = Any


class _VectorType(types.Type):
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


def _compare(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, one, two: builder.fcmp_ordered(sign, one, two)


def _unequal(builder: Any, one: Any, two: Any) -> Any:
    return builder.icmp_signed("!=", one, two)


_of_numbers = vector_type, types.float64
_of_words = word_type, types.int64
_of_flags = mask_type, types.boolean
for _operation, _kinds, _result, _instruction in (
    (operator.add, _of_numbers, vector_type, ir.IRBuilder.fadd),
    (operator.sub, _of_numbers, vector_type, ir.IRBuilder.fsub),
    (operator.mul, _of_numbers, vector_type, ir.IRBuilder.fmul),
    (operator.truediv, _of_numbers, vector_type, ir.IRBuilder.fdiv),
    (operator.lt, _of_numbers, mask_type, _compare("<")),
    (operator.le, _of_numbers, mask_type, _compare("<=")),
    (operator.gt, _of_numbers, mask_type, _compare(">")),
    (operator.ge, _of_numbers, mask_type, _compare(">=")),
    (operator.eq, _of_numbers, mask_type, _compare("==")),
    (operator.add, _of_words, word_type, ir.IRBuilder.add),
    (operator.and_, _of_words, word_type, ir.IRBuilder.and_),
    (operator.xor, _of_words, word_type, ir.IRBuilder.xor),
    (operator.lshift, _of_words, word_type, ir.IRBuilder.shl),
    (operator.ne, _of_words, mask_type, _unequal),
    (operator.and_, _of_flags, mask_type, ir.IRBuilder.and_),
    (operator.or_, _of_flags, mask_type, ir.IRBuilder.or_),
):
    _define(_operation, _kinds[0], _kinds[1], _result, _instruction)


def _check_array(array: Any) -> None:
    flat = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
    if not (flat and array.dtype == types.float64):
        raise TypingError(f"array must be contiguous float64 of one dimension, is {array}")


def _pointer(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    """Return the address of eight numbers in an array's memory."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [place]), _DOUBLES.as_pointer())


@intrinsic
def load(typing_context: Any, array: Any, place: Any) -> Any:
    """Return eight numbers that stand side by side in a contiguous array, from an index on.

    Neither `load` nor `store` checks that they lie within the array.
    """
    _check_array(array)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_pointer(context, builder, signature.args[0], *arguments))
        value.align = 8  # [B] that of a float64
        return value

    return vector_type(array, place), generate


@intrinsic
def store(typing_context: Any, array: Any, place: Any, vector: Any) -> Any:
    """Write eight numbers side by side into a contiguous array, from an index on."""
    _check_array(array)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, place, value = arguments
        written = builder.store(value, _pointer(context, builder, signature.args[0], array, place))
        written.align = 8
        return context.get_dummy_value()

    return types.void(array, place, vector), generate


@intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """Return a vector of one number in every lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _spread(builder, arguments[0], vector_type)

    return vector_type(types.float64), generate  # of an int, too


@intrinsic
def select(typing_context: Any, condition: Any, one: Any, two: Any) -> Any:
    """Return the first value in lanes where a condition holds, the second in the others."""
    kind = two if isinstance(two, _VectorType) else one

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        condition, *values = arguments
        if isinstance(kind, _VectorType):
            values = [_spread(builder, value, kind) for value in values]
        return builder.select(condition, *values)

    kinds = (one, two) if isinstance(kind, _VectorType) else (kind, kind)
    return kind(condition, *kinds), generate


@intrinsic
def _any_lane(typing_context: Any, mask: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = builder.bitcast(arguments[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", word, ir.Constant(word.type, 0))

    return types.boolean(mask_type), generate


any_lane: Callable[[Mask], bool] = _any_lane


def _of_llvm(name: str) -> Any:
    """Return a function for kernels: an operation of LLVM on every lane."""

    @intrinsic
    def operation(typing_context: Any, vector: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            kind = ir.FunctionType(_DOUBLES, [_DOUBLES])
            function = cgutils.get_or_insert_function(
                builder.module, kind, f"llvm.{name}.v{LANES}f64"
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


# of every lane: the square root, correctly rounded; the absolute value; the least whole number not
# below
root, magnitude, ceiling = map(_of_llvm, ("sqrt", "fabs", "ceil"))
# the bits of a float64 as an int64, of a vector as eight of them; and back
to_bits = _reinterpretation({types.float64: types.int64, vector_type: word_type})
from_bits = _reinterpretation({types.int64: types.float64, word_type: vector_type})


@inlined
def lower(one: Vector, two: Vector) -> Vector:
    """Return the smaller of two numbers, lane by lane; the first where either is NaN."""
    return select(two < one, two, one)


@inlined
def upper(one: Vector, two: Vector) -> Vector:
    """Return the greater of two numbers, lane by lane; the first where either is NaN."""
    return select(one < two, two, one)


def _interleaved(builder: Any, rows: list[Any], width: int) -> list[Any]:
    """Return pairs of rows with their groups of `width` numbers exchanged, as a square's halves.

    Row k and row k + width become two: the even groups of both, and the odd ones.
    """
    even, odd = [], []
    for k in range(LANES):
        source = k if k % (2 * width) < width else k + LANES - width
        even.append(source)
        odd.append(source + width)
    found = list(rows)
    for k in range(len(rows)):
        if not k & width:
            one, two = rows[k], rows[k + width]
            for place, order in ((k, even), (k + width, odd)):
                mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), order)
                found[place] = builder.shuffle_vector(one, two, mask)
    return found


@intrinsic
def transposed(typing_context: Any, rows: Any) -> Any:
    """Return eight vectors as rows of a square, transposed: lane j of row i: lane i of row j."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = [builder.extract_value(arguments[0], k) for k in range(LANES)]
        for width in (1, 2, 4):
            values = _interleaved(builder, values, width)
        return context.make_tuple(builder, signature.return_type, values)

    return rows(rows), generate
