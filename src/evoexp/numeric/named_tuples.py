"""Named tuples on their way from Python into a kernel that is called very often.

Reading an argument's type takes numba some 2 µs per named tuple and next to nothing per plain one.
So the caller makes nested named tuples `plain`, once per run, and the kernel has them `named`
again, which costs nothing.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast, get_type_hints

from numba.core import types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic, overload

Named = TypeVar("Named", bound=tuple[Any, ...])


def plain(value: Any) -> Any:
    """Return nested tuples, named or not, as plain tuples of the same values."""
    return tuple(plain(item) for item in value) if isinstance(value, tuple) else value


def _name(typing_context: Any, kind: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return impl_ret_borrowed(context, builder, signature.return_type, arguments[1])

    return _named_type(kind.instance_class, value)(kind, value), generate


def _named_type(kind: type, value: Any) -> Any:
    """Return numba's type of a named tuple class whose fields have the types of a plain tuple."""
    items = []
    for hint, item in zip(get_type_hints(kind).values(), value, strict=True):
        items.append(_named_type(hint, item) if _is_named(hint) else item)
    return types.BaseTuple.from_types(items, pyclass=kind)


def _is_named(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields")


_named: Callable[[Any, Any], Any] = cast(Any, intrinsic(_name))


def named(kind: type[Named], value: Any) -> Named:
    """Return a plain tuple as a named one, in kernels, also where they are interpreted.

    Fields that are annotated as named tuples are named, too, to any depth.

    Args:
        kind: The class of named tuples.
        value: From `plain`.
    """
    items = zip(get_type_hints(kind).values(), value, strict=True)
    return kind(*(named(hint, item) if _is_named(hint) else item for hint, item in items))


@overload(named)
def _compile_named(kind: Any, value: Any) -> Any:
    def compiled(kind: Any, value: Any) -> Any:  # numba compares annotations, too
        return _named(kind, value)

    return compiled
