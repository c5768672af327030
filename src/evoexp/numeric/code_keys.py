"""The key of a module: a hash of all code that can change a kernel in it.

That is its code and the code of every module that it imports, down to the last one, without
comments, docstrings and annotations. So no stale kernel can be loaded, an edit recompiles only what
depends on it, an edit of words recompiles nothing, and two checkouts share what is alike in them.

The key is that of the files, and kernels are made of the code that a process loaded. Where a file
is edited while the process runs, the two differ: `loaded_key` is the key of the loaded code.
"""

import ast
import contextlib
import functools
import hashlib
import inspect
import json
import os
import sys
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.numeric.kept_files import Damaged, cache_root, read_kept, write_kept
from evoexp.version import version_of

_PACKAGE = "evoexp"
# Modules that keep kernels and change none; their own format is named by the folder `kernels`.
_KEEPERS = {
    f"evoexp.numeric.{name}" for name in ("code_keys", "kernel_cache", "kernel_files", "kept_files")
}
_ROOT = Path(__file__).parents[2]
_files: dict[str, Path] = {}  # of modules that were found; others may be imported later
_no_modules = set[str]()  # names of evoexp that are no modules: functions, classes


class Source(NamedTuple):
    """The code of one module, as far as it can change a compiled kernel.

    Attributes:
        digest: Of its syntax tree, without docstrings and annotations of functions.
        imports: Dotted names that it imports; `package.name` may be a module or a name in one.
    """

    digest: str
    imports: tuple[str, ...]


@functools.cache
def compilers() -> tuple[str, ...]:
    """Return the versions of what compiles kernels, without loading any of it."""
    return version_of("numba"), version_of("llvmlite"), sys.version


@functools.cache
def module_key(module: str) -> str:
    """Return the hash of a module's code and of all code that it imports from evoexp or its own.

    Args:
        module: Dotted name; one that cannot be found counts by its name alone.
    """
    digest = hashlib.sha256(" ".join(compilers()).encode())
    for name in sorted(_reached(module)):
        source = _source_of(name)
        digest.update(f"{name}\0{source.digest if source else ''}\0".encode())
    return digest.hexdigest()


@functools.cache
def loaded_key(module: str) -> str:
    """Return the hash of the code that this process loaded, of a module and of all its imports.

    It is made of the functions, classes and constants themselves, so it needs no file: the code of
    a process whose files were edited meanwhile has another key than the edited code.

    Args:
        module: Dotted name of a loaded module.
    """
    packages = {_PACKAGE, module.split(".")[0]}
    described, waiting = dict[str, Any](), {module}
    while waiting:
        name = waiting.pop()
        loaded = sys.modules.get(name)
        described[name] = None if loaded is None else _members(loaded, name)
        origins = {_origin(value) for value in vars(loaded).values()} if loaded else set()
        waiting |= {
            origin
            for origin in origins - described.keys() - _KEEPERS
            if origin.split(".")[0] in packages and not hasattr(sys.modules.get(origin), "__path__")
        }
    return hashlib.sha256(repr(sorted(described.items())).encode()).hexdigest()


def _origin(value: Any) -> str:
    """Return the name of the module that a value comes from, or is; none for constants."""
    origin = getattr(value, "__name__" if isinstance(value, types.ModuleType) else "__module__", "")
    return origin if isinstance(origin, str) else ""


def _members(owner: Any, module: str) -> list[tuple[str, Any]]:
    """Describe what a module or a class defines, ordered by name."""
    members = sorted(vars(owner).items())
    return [(name, _described(value, module)) for name, value in members if name[:2] != "__"]


def _described(value: Any, module: str) -> Any:
    """Describe a value of a module as far as a compiled kernel can depend on it."""
    function = inspect.unwrap(getattr(value, "py_func", value))  # of a kernel or an intrinsic
    if isinstance(function, types.FunctionType):
        return code_of(function.__code__, function.__doc__), repr(function.__defaults__)
    if isinstance(value, type):
        return _members(value, module) if value.__module__ == module else value.__qualname__
    if isinstance(value, tuple):
        return type(value).__name__, [_described(item, module) for item in value]
    if isinstance(value, bool | int | float | complex | None):
        return repr(value)
    if type(value).__name__ == "ndarray":
        return str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    return type(value).__name__


def code_of(code: types.CodeType, docstring: str | None = None) -> Any:
    """Describe the instructions, names and constants of a code object, without its docstring."""
    constants = [
        _constant(value)
        for k, value in enumerate(code.co_consts)
        if not (k == 0 and docstring is not None and value == docstring)
    ]
    return code.co_code, code.co_names, code.co_varnames, constants


def _constant(value: Any) -> Any:
    if isinstance(value, types.CodeType):
        return code_of(value)
    if isinstance(value, frozenset):  # its order is another one in every process
        return sorted(map(repr, value))
    return type(value).__name__, repr(value)


def is_kernel_module(module: str) -> bool:
    """Return whether a module is evoexp's, or imports something of it."""
    if _file_of(module) is None:
        return False
    source = _source_of(module)
    return source is not None and any(name.split(".")[0] == _PACKAGE for name in source.imports)


@functools.cache
def _reached(module: str) -> frozenset[str]:
    """Return a module and all modules that it imports, directly or not."""
    found, waiting = {module}, [module]
    while waiting:
        source = _source_of(waiting.pop())
        for name in source.imports if source else ():
            inner = name if _file_of(name) is not None else name.rpartition(".")[0]
            if inner in found or inner in _KEEPERS:
                continue
            if _file_of(inner) is not None:
                found.add(inner)
                waiting.append(inner)
    return frozenset(found)


def _file_of(module: str) -> Path | None:
    """Return the file of a module of evoexp or of a package that is imported; None for others."""
    if module in _files or module in _no_modules:
        return _files.get(module)
    package, *parts = module.split(".")
    within = _file_of(module.rpartition(".")[0]) if package == _PACKAGE and parts else None
    if within is not None and within.name != "__init__.py":  # a function or class of that module
        _no_modules.add(module)
        return None
    for root in [_ROOT] if package == _PACKAGE else _roots_of(package):
        path = os.path.join(root, package, *parts)  # a `Path` of each name takes long
        for candidate in (f"{path}.py", os.path.join(path, "__init__.py")):
            if os.path.isfile(candidate):
                return _files.setdefault(module, Path(candidate))
    if package == _PACKAGE:
        _no_modules.add(module)
    return None


def _roots_of(package: str) -> list[Path]:
    """Return the folders in which an imported package lies: several if it is a namespace."""
    loaded = sys.modules.get(package)
    if file := getattr(loaded, "__file__", None):
        return [Path(file).parents[1] if Path(file).stem == "__init__" else Path(file).parent]
    return [Path(folder).parent for folder in getattr(loaded, "__path__", ())]


def _source_of(module: str) -> Source | None:
    """Return the code of a module; None for one of another package."""
    path = _file_of(module)
    return None if path is None else _read_source(module, path)


@functools.cache
def _read_source(module: str, path: Path) -> Source:
    """Return the code of a module; parsed once per content and then kept beside the kernels."""
    content = path.read_bytes()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    name = hashlib.sha256(f"{sys.version}\0{package}\0".encode() + content).hexdigest()[:32]
    kept = cache_root() / "sources" / f"{name}.json"
    with contextlib.suppress(FileNotFoundError, Damaged):
        plain = json.loads(read_kept(kept))
        return Source(plain["digest"], tuple(plain["imports"]))
    source = parse(content, package)
    with contextlib.suppress(OSError):
        write_kept(kept, json.dumps(source._asdict()).encode())
    return source


def parse(content: bytes, package: str) -> Source:
    """Return the code of a file, without comments, docstrings and annotations of functions.

    Args:
        content: Of the file.
        package: Dotted name of the package that it is in, for relative imports.
    """
    tree, imports = ast.parse(content), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.rsplit(".", node.level - 1)[0] if node.level else ""
            origin = ".".join(part for part in (base, node.module) if part)
            imports.update(f"{origin}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = list(_without_docstring(node.body))
    ours = sorted(name for name in imports if name.split(".")[0] in (_PACKAGE, *package.split(".")))
    return Source(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), tuple(ours))


def _without_docstring(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
            yield statement
