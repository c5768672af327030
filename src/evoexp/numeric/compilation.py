"""How kernels are compiled: the options that every kernel shares, and arrays without counts.

The options keep results bit-identical: no fastmath, no contraction, no reassociation.
"""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import cgutils, types

from evoexp.numeric.kernel_folders import CHECKSUMS, kept_kernels

Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "fastmath": False,  # nor contraction, nor reassociation: the same bits on every machine
    "error_model": "numpy",
    "nogil": True,
    "boundscheck": False,
}


def kernel(function: Function) -> Function:
    """Compile a function with the options that keep results bit-identical; numba keeps the code."""
    return _compiled(function, _OPTIONS)


def inlined(function: Function) -> Function:
    """Compile like `kernel`, and have LLVM inline every call: a loop around a call stays scalar."""
    return _compiled(function, _OPTIONS | {"forceinline": True})


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    with kept_kernels(function) as are_kept:
        if are_kept:
            with contextlib.suppress(RuntimeError):  # numba cannot keep what is in no file
                compiled = numba.njit(cache=True, **options)(function)
                CHECKSUMS.check(Path(compiled.stats.cache_path))
                return cast(Function, compiled)
    return cast(Function, numba.njit(**options)(function))


class KernelAddress(numba.types.WrapperAddressProtocol):
    """A kernel that other kernels take as an argument, by its address and the types it takes.

    They are compiled once for all kernels of a signature; handed the kernel itself, once for each.
    """

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        """Compile a function decorated by `kernel`, or load it, by numba's types of it."""
        compiled: Any = function
        compiled.compile(signature.args)
        result = compiled.get_compile_result(signature)
        self._address = result.library.get_pointer_to_function(
            result.fndesc.llvm_cfunc_wrapper_name
        )
        self._signature = signature
        self._numba_type_ = numba.types.FunctionType(signature)  # looked for at every call

    def __wrapper_address__(self) -> int:
        """Return the address, as numba asks for it."""
        return int(self._address)

    def signature(self) -> Any:
        """Return the types, as numba asks for them."""
        return self._signature


# numba's decorator; kernels call such a function without its first argument
intrinsic: Callable[..., Any] = numba.extending.intrinsic


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a value whose pointers to its owner are null, and those of its items to any depth."""
    fields: tuple[str, ...] = ()
    if isinstance(kind, types.Array):
        fields = ("meminfo", "parent")
    elif isinstance(kind, types.NumPyRandomGeneratorType):
        fields = ("meminfo",)
    elif isinstance(kind, types.BaseTuple):
        for k, item in enumerate(cast(Any, kind)):
            part = _without_owner(context, builder, item, builder.extract_value(value, k))
            value = builder.insert_value(value, part, k)
    model = context.data_model_manager[kind]
    for field in fields:
        null = cgutils.get_null_value(model.get(builder, value, field).type)
        value = model.set(builder, value, null, field)
    return value


@intrinsic
def view_part(typing_context: Any, array: Any, first: Any, count: Any) -> Any:
    """Return part of a flat contiguous array of eight-byte items, as a view that owns nothing.

    Its arguments: the array, the place of the first item, how many. Nothing is checked. It takes
    the time of an addition; numba's slices take some 20 ns. An array born in a kernel must be used
    once more behind the last use of its views.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole, first, count = arguments
        data = context.make_array(signature.args[0])(context, builder, whole).data
        itemsize = context.get_constant(types.intp, 8)
        fields = {
            "data": builder.gep(data, [first]),
            "nitems": count,
            "itemsize": itemsize,
            "shape": cgutils.pack_array(builder, [count]),
            "strides": cgutils.pack_array(builder, [itemsize]),
        }
        model = context.data_model_manager[signature.return_type]
        view = cgutils.get_null_value(model.get_value_type())  # no owner
        for field, value in fields.items():
            view = model.set(builder, view, value, field)
        return view

    return types.Array(array.dtype, 1, "C")(array, types.intp, types.intp), generate


@intrinsic
def copy_part(typing_context: Any, source: Any, first: Any, out: Any, at: Any, count: Any) -> Any:
    """Copy some items of a flat contiguous array into another one of the same type.

    Its arguments: the array, the place of the first item, the other array, the place there, how
    many. No place is checked; the parts must not overlap. A loop that copies some dozen items one
    by one, or as vectors with a rest, takes several times as long.
    """
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


@intrinsic
def borrowed(typing_context: Any, value: Any) -> Any:
    """Return arrays, generators, or tuples of them to any depth, as views that own nothing.

    numba counts a reference, atomically, wherever an array is read out of a tuple or handed on, and
    wherever a number is drawn; in a kernel that takes dozens of arrays and calls small `inlined`
    functions the counting takes most of the time. To be used for arguments only: the caller keeps
    them alive, while an array born in a kernel is freed where its name is last used.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _without_owner(context, builder, value, arguments[0])

    return value(value), generate
