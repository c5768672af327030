"""Eight rows of numbers as columns: a square of vectors, transposed by shuffles."""

from typing import Any

from llvmlite import ir

from evoexp.numeric.compilation import intrinsic
from evoexp.numeric.vectors import LANES


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
