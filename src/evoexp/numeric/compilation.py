"""How kernels are compiled: the options that every kernel shares, and arrays without counts.

The options keep results bit-identical: no fastmath, no contraction, no reassociation.

numba keeps compiled kernels in folders of the user's cache. A folder's name is a hash of all that a
kernel is made of: evoexp's sources, those of the package of a guest's kernel, numba, llvmlite and
the processor. So an edit compiles kernels again.

numba reads its files as they are: a damaged one would end in a traceback, or run as machine code.
So files are listed with their checksums when they are written. Where one is not as it was listed,
all files of its folder are removed before the first kernel is loaded from there.
"""

import contextlib
import functools
import hashlib
import os
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite.binding
import numba
import xxhash
from numba.core import cgutils, event, types

from evoexp.numeric.cache_folder import cache_root, is_own

Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "fastmath": False,  # nor contraction, nor reassociation: the same bits on every machine
    "error_model": "numpy",
    "nogil": True,
    "boundscheck": False,
}
LIST = "checksums"  # name of the file that lists the others: a line of checksum and name for each
NUM_KEPT = 4  # [-] folders that are kept
KEPT_S = 86_400.0  # [s] and any that was used so lately
LEAST_ROOM = 2**27  # [B] free on the disk: numba fails if it cannot write a kernel
PATIENCE_S = 10.0  # [s] for another process that writes a kernel

# The rooms above all kernels, by the layers of imports: kernels are not made of their code.
ROOMS_ABOVE = frozenset(
    {"batch", "commands", "configuration", "papers", "playback", "report", "testing", "assets"}
)
_OWN = __name__.split(".")[0]
_STATES: dict[str, list[tuple[Path, int]]] = {}  # of packages' sources, when they were hashed


def kernel(function: Function) -> Function:
    """Compile a function with the options that keep results bit-identical; numba keeps the code."""
    return _compiled(function, _OPTIONS)


def inlined(function: Function) -> Function:
    """Compile like `kernel`, and have LLVM inline every call: a loop around a call stays scalar."""
    return _compiled(function, _OPTIONS | {"forceinline": True})


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    callees = [value for value in function.__globals__.values() if hasattr(value, "py_func")]
    packages = {each.__module__.split(".")[0] for each in (function, *callees)} | {_OWN}
    is_lambda = function.__name__ == "<lambda>"  # lines may be alike
    folder = None if is_lambda else _folder_of(frozenset(packages))
    if folder is not None:
        # numba looks at its settings where a kernel is defined
        config: Any = numba.config
        before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), "UserProvidedCacheLocator"
        try:
            compiled = numba.njit(cache=True, **options)(function)
            CHECKSUMS.check(Path(compiled.stats.cache_path))
            return cast(Function, compiled)
        except RuntimeError:  # numba cannot keep what is in no file
            pass
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
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


# folders of compiled kernels, with checksums of their files


@functools.cache
def _folder_of(packages: frozenset[str]) -> Path | None:
    """Make the folder for kernels of some packages; None without sources or a place to write."""
    with contextlib.suppress(OSError):
        root = cache_root() / "kernels"
        folder = root / _key(packages)
        folder.mkdir(parents=True, exist_ok=True)
        if shutil.disk_usage(folder).free >= LEAST_ROOM:
            os.utime(folder)
            remove_old(root)
            return folder
    return None


def remove_old(root: Path) -> None:
    """Remove folders of kernels, but not the newest ones and those that were used of late."""
    with contextlib.suppress(OSError):
        folders = sorted(root.iterdir(), key=lambda folder: folder.stat().st_mtime)
        for folder in folders[:-NUM_KEPT]:
            if time.time() - folder.stat().st_mtime > KEPT_S:
                shutil.rmtree(folder, ignore_errors=True)


def _key(packages: frozenset[str]) -> str:
    """Return the hash of some packages' sources, the compilers' versions and the processor."""
    compilers = sys.version, numba.__version__, llvmlite.__version__
    features = llvmlite.binding.get_host_cpu_features().flatten()
    processor = llvmlite.binding.get_host_cpu_name(), features
    key = hashlib.sha256(repr((compilers, processor)).encode())
    for package in sorted(packages):
        key.update(sources_key(package).encode())
    return key.hexdigest()[:16]


@functools.cache
def sources_key(package: str = _OWN) -> str:
    """Return the hash of all sources of a package that kernels can be made of, or OSError."""
    key, _STATES[package] = hashlib.sha256(), _states(package)
    for path, _ in _STATES[package]:
        key.update(f"{path.name}\0".encode())
        key.update(path.read_bytes())
    return key.hexdigest()


def _states(package: str) -> list[tuple[Path, int]]:
    """Return the Python files of a package, or of a module's folder, and when each was changed."""
    module, paths = sys.modules[package], list[Path]()
    if hasattr(module, "__path__"):
        for folder in map(Path, module.__path__):
            hidden = ROOMS_ABOVE if package == _OWN else frozenset[str]()
            paths += folder.glob("*.py")
            for room in folder.glob("*/"):
                paths += room.rglob("*.py") if room.name not in hidden else []
    elif module.__dict__.get("__file__") is not None:
        paths += Path(str(module.__file__)).parent.glob("*.py")
    else:
        raise FileNotFoundError(package)
    return [(path, path.stat().st_mtime_ns) for path in sorted(paths)]


class Checksums(event.Listener):
    """The checksums of numba's files, and a lock while one is written.

    numba says when it has compiled a kernel, before it writes it, and when it lets its own lock go.
    """

    def __init__(self) -> None:
        self._checked = set[Path]()
        self._writing: list[tuple[Path, Any]] = []  # folders, and the lock of each

    def check(self, folder: Path) -> None:
        """Remove the files of a folder if one is not as it was listed; looked at once."""
        if folder not in self._checked and _unlisted(folder):
            lock = _locked(folder)
            if _unlisted(folder):
                shutil.rmtree(folder, ignore_errors=True)
            lock.release()
        self._checked.add(folder)

    def on_start(self, event: Any) -> None:
        """Do nothing."""

    def on_end(self, event: Any) -> None:
        """Lock a folder before a kernel is written to it; then list its files."""
        if event.kind == "numba:compile":
            folder = Path(event.data["dispatcher"].stats.cache_path or "")
            if folder in self._checked:
                self._writing.append((folder, _locked(folder)))
            return
        while self._writing:
            folder, lock = self._writing.pop()
            with contextlib.suppress(OSError):
                # sources that changed since they were hashed may have been loaded by now
                loaded = {name: states for name, states in _STATES.items() if name in sys.modules}
                if all(_states(package) == states for package, states in loaded.items()):
                    list_files(folder)
            lock.release()


CHECKSUMS = Checksums()
for _kind in ("numba:compile", "numba:compiler_lock"):
    event.register(_kind, CHECKSUMS)


def list_files(folder: Path) -> None:
    """Append the files of a folder that are new or changed to its list."""
    lines = sorted(_unlisted(folder))
    with open(folder / LIST, "a", encoding="utf-8") as file:
        file.write("".join(f"{line}\n" for line in lines))


def _unlisted(folder: Path) -> set[str]:
    """Return the lines of numba's files that are not in this user's list of a folder."""
    path, files = folder / LIST, folder.glob("*.nb[ic]")  # indices and machine code
    lines = {f"{xxhash.xxh3_128_hexdigest(file.read_bytes())} {file.name}" for file in files}
    listed = path.read_text(errors="replace") if path.is_file() and is_own(path) else ""
    return lines - set(listed.splitlines())


def _locked(folder: Path) -> Any:
    """Let no other process write to a folder; a lock that cannot be had is no reason to fail."""
    from filelock import FileLock, Timeout  # only what compiles needs it

    lock = FileLock(folder.with_suffix(".lock"))
    with contextlib.suppress(OSError, Timeout):
        lock.acquire(timeout=PATIENCE_S)
    return lock
