"""How kernels are compiled: the options that every kernel shares, and arrays without counts.

The options keep results bit-identical: no fastmath, no contraction, no reassociation.
"""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

from evoexp.numeric.bare_numba import numba
from evoexp.numeric.kernel_cache import SharedCache, use_content_cache
from evoexp.numeric.plain_arrays import use_plain_arrays

Function = TypeVar("Function", bound=Callable[..., Any])
Value = TypeVar("Value")

cgutils, types, intrinsic = numba.core.cgutils, numba.core.types, numba.extending.intrinsic

use_content_cache()
use_plain_arrays()

_OPTIONS: dict[str, Any] = {
    "fastmath": False,  # nor contraction, nor reassociation: the same bits on every machine
    "error_model": "numpy",
    "nogil": True,
    "boundscheck": False,
    "_nrt": True,  # else inherited from whichever kernel is compiled when this one is first called
}


def kernel(function: Function) -> Function:
    """Compile a function with the options that keep results bit-identical, once for all time."""
    compiled: Function = _kept(numba.njit(**_OPTIONS)(function))
    return compiled


def inlined(function: Function) -> Function:
    """Compile like `kernel`, and have LLVM inline every call: a loop around a call stays scalar."""
    compiled: Function = _kept(numba.njit(forceinline=True, **_OPTIONS)(function))
    return compiled


def uncounted(function: Function) -> Function:
    """Compile a kernel that creates no array like `kernel`, but without counts of references.

    A `kernel` that another one calls counts a reference to every array of its arguments, in tuples
    too, when it begins and when it ends: with the tuples of a search that is fifty calls.
    """
    compiled: Function = _kept(numba.njit(**_OPTIONS | {"_nrt": False})(function))
    return compiled


def _kept(dispatcher: Any) -> Any:
    """Have a kernel's machine code kept, and compiled by one process at a time."""
    dispatcher._cache = SharedCache(dispatcher.py_func)
    return dispatcher


def _borrow(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _without_owner(context, builder, value, arguments[0])

    return value(value), generate


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.NumPyRandomGeneratorType):
        generator = cgutils.create_struct_proxy(kind)(context, builder, value)
        generator.meminfo = cgutils.get_null_value(generator.meminfo.type)
        return generator._getvalue()
    if isinstance(kind, types.BaseTuple):
        items: Any = kind
        for k, item in enumerate(items):
            part = _without_owner(context, builder, item, builder.extract_value(value, k))
            value = builder.insert_value(value, part, k)
    return value


def _viewing(num_widths: int) -> Any:
    """Return a function for kernels that views part of a flat array, with rows or without."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from numba.np.arrayobj import populate_array  # what only compiles is not loaded to run

        whole, first, *shape = arguments
        data = context.make_array(signature.args[0])(context, builder, whole).data
        itemsize = context.get_constant(types.intp, 8)
        made = context.make_array(signature.return_type)(context, builder)
        populate_array(
            made,
            data=builder.gep(data, [first]),
            shape=cgutils.pack_array(builder, shape),
            strides=cgutils.pack_array(
                builder, [*(builder.mul(width, itemsize) for width in shape[1:]), itemsize]
            ),
            itemsize=itemsize,
            meminfo=None,
        )
        return made._getvalue()

    def flat(typing_context: Any, array: Any, first: Any, count: Any) -> Any:
        return types.Array(array.dtype, 1, "C")(array, types.intp, types.intp), generate

    def rows(typing_context: Any, array: Any, first: Any, count: Any, width: Any) -> Any:
        view = types.Array(array.dtype, 2, "C")
        return view(array, types.intp, types.intp, types.intp), generate

    return intrinsic(rows if num_widths else flat)


view_part: Callable[..., Any] = _viewing(0)
"""Return part of a flat contiguous array of eight-byte items, as a view that owns nothing.

Its arguments: the array, the place of the first item, how many. Nothing is checked. It takes the
time of an addition; numba's slices take some 20 ns. An array born in a kernel must be used once
more behind the last use of its views.
"""

view_rows: Callable[..., Any] = _viewing(1)
"""Return rows in a flat array: as `view_part`, the width of a row as fourth argument."""


def _copy(typing_context: Any, source: Any, first: Any, out: Any, at: Any, count: Any) -> Any:
    if {source.layout, out.layout} != {"C"} or source.dtype != out.dtype:
        return None  # numba says that there is no such function

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, first, out, at, count = arguments
        here = context.make_array(signature.args[0])(context, builder, source).data
        there = context.make_array(signature.args[2])(context, builder, out).data
        size = context.get_abi_sizeof(context.get_data_type(signature.args[0].dtype))
        cgutils.raw_memcpy(
            builder, builder.gep(there, [at]), builder.gep(here, [first]), count, size
        )
        return context.get_dummy_value()

    index = types.intp
    return types.none(source, index, out, index, index), generate


copy_part: Callable[..., None] = intrinsic(_copy)
"""Copy some items of a flat contiguous array into another one of the same type.

Its arguments: the array, the place of the first item, the other array, the place there, how many.
No place is checked; the parts must not overlap. A loop that copies some dozen items one by one, or
as vectors with a rest, takes several times as long.
"""


class _Borrowing(Protocol):
    def __call__(self, value: Value, /) -> Value: ...


borrowed: _Borrowing = cast(Any, intrinsic(_borrow))
"""Return arrays, generators, or tuples of them to any depth, as views that own nothing.

numba counts a reference, atomically, wherever an array is read out of a tuple or handed on, and
wherever a number is drawn; in a kernel that takes dozens of arrays and calls small `inlined`
functions the counting takes most of the time. To be used for arguments only: the caller keeps them
alive, while an array born in a kernel is freed where its name is last used.
"""
