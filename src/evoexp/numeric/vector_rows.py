"""Eight rows of numbers as columns: vectors whose lanes come from places of their own.

A kernel that follows eight paths at once needs, sooner or later, numbers that stand at another
place in each of them. Written row by row (`transposed`, one row per lane), what belongs together
stands side by side, and is read by one load per lane and a few shuffles (`load_pairs`,
`load_quads`), a fraction of the cost of a load per number.
"""

from collections.abc import Iterator
from typing import Any, TypeAlias

from llvmlite import ir
from numba.core import cgutils, types

from evoexp.numeric.compilation import intrinsic
from evoexp.numeric.vectors import LANES, vector_type

Eight: TypeAlias = Any  # a tuple of eight vectors
_INDEX = ir.IntType(32)
_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)


def _shuffle(builder: Any, one: Any, two: Any, order: list[int]) -> Any:
    """Return chosen numbers of two vectors, counted through both."""
    mask = ir.Constant(ir.VectorType(_INDEX, len(order)), order)
    return builder.shuffle_vector(one, two, mask)


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
            found[k] = _shuffle(builder, one, two, even)
            found[k + width] = _shuffle(builder, one, two, odd)
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


def _addresses(context: Any, builder: Any, signature: Any, arguments: Any) -> Iterator[Any]:
    """Yield the addresses in an array at an offset from the places that another one holds."""
    array, places = (
        context.make_array(kind)(context, builder, value).data
        for kind, value in zip(signature.args[:2], arguments[:2], strict=True)
    )
    own = builder.gep(places, [arguments[2]])
    for lane in range(LANES):
        place = builder.load(builder.gep(own, [ir.Constant(ir.IntType(64), lane)]))
        yield builder.gep(array, [builder.add(place, arguments[3])])


def _columns(width: int) -> Any:
    """Return a function for kernels that reads `width` numbers for each lane, as vectors.

    Its arguments: a contiguous array (whether the numbers lie within it is not checked), an array
    of places, one per lane, from an index on, that index, and an offset from all places.
    """

    @intrinsic
    def read(typing_context: Any, array: Any, places: Any, at: Any, offset: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            part, parts = ir.VectorType(ir.DoubleType(), width), []
            for address in _addresses(context, builder, signature, arguments):
                value = builder.load(builder.bitcast(address, part.as_pointer()))
                value.align = 8  # [B] that of a float64
                parts.append(value)
            rows = _joined(builder, parts)
            whole = signature.return_type
            return rows[0] if width == 1 else context.make_tuple(builder, whole, rows)

        result = vector_type if width == 1 else types.UniTuple(vector_type, width)
        return result(array, places, types.uint64, types.uint64), generate

    return read


def _joined(builder: Any, parts: list[Any]) -> list[Any]:
    """Return parts of `width` numbers, one of each lane, as `width` vectors."""
    width = parts[0].type.count
    # whole vectors of the parts of the lanes k, k + width, k + 2 width …
    rows = []
    for first in range(width):
        row = parts[first::width]
        while len(row) > 1:
            size = row[0].type.count
            both = list(range(2 * size))
            row = [_shuffle(builder, a, b, both) for a, b in zip(row[::2], row[1::2], strict=True)]
        rows.append(row[0])
    step = 1
    while step < width:
        rows = _interleaved(builder, rows, step)
        step *= 2
    return rows


load_each, load_pairs, load_quads = map(_columns, (1, 2, 4))


@intrinsic
def num_up_to(
    typing_context: Any, array: Any, places: Any, at: Any, offset: Any, limits: Any
) -> Any:
    """Return how many of the last seven of eight numbers are not above each lane's limit.

    The arguments before the limits are those of `load_pairs`.
    """
    counted = int.from_bytes(bytes([0xFE] * LANES), "little")  # bits that count, of every lane

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        limits, masks = arguments[4], []
        for lane, address in enumerate(_addresses(context, builder, signature, arguments)):
            row = builder.load(builder.bitcast(address, _DOUBLES.as_pointer()))
            row.align = 8
            limit = _shuffle(builder, limits, limits, [lane] * LANES)
            masks.append(builder.fcmp_ordered("<=", row, limit))
        while len(masks) > 1:
            both = list(range(2 * masks[0].type.count))
            pairs = zip(masks[::2], masks[1::2], strict=True)
            masks = [_shuffle(builder, a, b, both) for a, b in pairs]
        # through a scalar register: LLVM would pass the masks through memory, and wait for them
        bits = ir.IntType(LANES * LANES)
        both = ir.VectorType(bits, 2)
        word = builder.and_(builder.bitcast(masks[0], bits), ir.Constant(bits, counted))
        pair = builder.insert_element(ir.Constant(both, None), word, ir.Constant(_INDEX, 0))
        bytes_ = builder.bitcast(pair, ir.VectorType(ir.IntType(8), 2 * LANES))
        narrow = _shuffle(builder, bytes_, bytes_, list(range(LANES)))
        words = ir.VectorType(ir.IntType(64), LANES)
        kind = ir.FunctionType(words, [words])
        ones = cgutils.get_or_insert_function(builder.module, kind, f"llvm.ctpop.v{LANES}i64")
        wide = builder.call(ones, [builder.zext(narrow, words)])
        return builder.sitofp(wide, _DOUBLES)

    return vector_type(array, places, types.uint64, types.uint64, vector_type), generate


@intrinsic
def lane_numbers(typing_context: Any) -> Any:
    """Return 0, 1, … 7."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(_DOUBLES, [float(lane) for lane in range(LANES)])

    return vector_type(), generate


@intrinsic
def store_places(typing_context: Any, array: Any, place: Any, vector: Any) -> Any:
    """Write eight whole numbers, not negative, as places into an array, from an index on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        words = ir.VectorType(ir.IntType(64), LANES)
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        pointer = builder.bitcast(builder.gep(data, [arguments[1]]), words.as_pointer())
        written = builder.store(builder.fptosi(arguments[2], words), pointer)
        written.align = 8
        return context.get_dummy_value()

    return types.void(array, types.uint64, vector_type), generate
