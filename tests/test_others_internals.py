"""evoexp reads, sets and replaces nothing in other packages that they do not document."""

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted(
    path
    for path in [*(ROOT / "src").rglob("*.py"), *(ROOT / "scripts").rglob("*.py")]
    if "assets" not in path.parts
)

# What Python documents, although it begins with an underscore.
DOCUMENTED = {"_asdict", "_fields", "_make", "_replace", "_field_defaults"}
# Hooks and settings that are documented as such.
SETTINGS = {
    *("config.CACHE_DIR", "config.CACHE_LOCATOR_CLASSES"),  # numba's
    *("sys.excepthook", "sys.stderr", "sys.stdin", "sys.stdout", "sys.unraisablehook"),
    *("tempfile.tempdir", "threading.excepthook", "warnings.showwarning"),
}
# A worker ends at once when its parent is gone, and a forked one does not end as its parent does.
ENDS_AT_ONCE = re.compile(r"evoexp/batch/\w*worker\w*\.py$")
MODULE_TABLE_CALLS = {"update", "pop", "setdefault", "clear", "popitem"}


def is_private(name: str) -> bool:
    """Return whether a name begins with one underscore; `_` and `_target_` do not count."""
    return len(name) > 1 and name.startswith("_") and not name.endswith("_")


def own_names(trees: Iterable[ast.AST]) -> set[str]:
    """Return the underscored names that evoexp defines itself."""
    names = set()
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.update([node.attr] * (ast.unparse(node.value) in ("self", "cls")))
    return set(filter(is_private, names))


def foreign_names(tree: ast.AST) -> set[str]:
    """Return the names in a file that stand for something of another package."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            others = [alias for alias in node.names if alias.name.split(".")[0] != "evoexp"]
            names.update(alias.asname or alias.name.split(".")[0] for alias in others)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] != "evoexp":
            names.update(alias.asname or alias.name for alias in node.names)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(node.value, ast.Attribute):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if root(node.value) in names:
                names.update(each.id for each in targets if isinstance(each, ast.Name))
    return names


def root(node: ast.expr) -> str:
    """Return the name with which a chain of attributes and items begins."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def violations(path: str, tree: ast.AST, own: set[str]) -> Iterator[str]:
    """Yield what a file does to other packages that it must not do."""
    foreign = foreign_names(tree)

    def is_undocumented(name: str) -> bool:
        return is_private(name) and name not in DOCUMENTED | own

    for node in ast.walk(tree):
        match node:
            case ast.Import(names):
                modules = (alias.name for alias in names)
                yield from (name for name in modules if any(map(is_private, name.split("."))))
            case ast.ImportFrom(module, names) if (module or "").split(".")[0] != "evoexp":
                parts = [*(module or "").split("."), *(alias.name for alias in names)]
                yield from filter(is_private, parts)
            case ast.Subscript(ctx=ast.Store() | ast.Del()):
                yield from ["sys.modules"] * (ast.unparse(node.value) == "sys.modules")
            case ast.Attribute(value, name):
                text, is_changed = ast.unparse(node), not isinstance(node.ctx, ast.Load)
                if text == "os._exit":
                    yield from [text] * (ENDS_AT_ONCE.search(path) is None)
                elif name in ("ctypes", "co_stacksize"):
                    yield name
                elif is_private(name) and name not in DOCUMENTED:
                    yield from [name] * (root(node) in foreign or name not in own)
                elif is_changed and root(node) in foreign:
                    is_own_module = ast.unparse(value) == "sys.modules[__name__]"
                    yield from [text] * (not is_own_module and text not in SETTINGS)
            case ast.Call(function, arguments, keywords):
                called, texts = ast.unparse(function), [ast.unparse(each) for each in arguments]
                words = [word.arg for word in keywords if word.arg]
                yield from (w for w in words if w == "co_stacksize" or is_undocumented(w))
                if called.rpartition(".")[0] == "sys.modules":
                    yield from [called] * (called.rpartition(".")[2] in MODULE_TABLE_CALLS)
                if called in ("getattr", "hasattr", "setattr", "delattr") and len(texts) > 1:
                    yield from filter(is_undocumented, [texts[1].strip("'")])
                    if called in ("setattr", "delattr"):
                        yield from [called] * (root(arguments[0]) in foreign)


def test_nothing_of_other_packages_is_read_or_replaced() -> None:
    trees = {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text()) for path in FILES}
    own = own_names(trees.values())
    found = {place: set(violations(place, tree, own)) for place, tree in trees.items()}
    assert not {place: names for place, names in found.items() if names}


@pytest.mark.parametrize(
    "code",
    [
        "import numba\nnumba.core._x",
        "from numba.core import _x",
        "import hydra._internal",
        "import numba\nnumba.njit = 1",
        "from numba.core.codegen import JITCPUCodegen as C\nC.kind = 1",
        "import numba\nsetattr(numba.core, name, 1)",
        "import numba\ndel numba.core.x",
        "import numba\nconfig = numba.config\nconfig.OPT = 0",
        "value._getvalue()",
        "getattr(value, '_getvalue')",
        "import sys\nsys.modules['x'] = None",
        "import sys\ndel sys.modules['x']",
        "import sys\nsys.modules.update(x)",
        "import sys\nsys.modules.pop('x')",
        "array.ctypes.data",
        "code.replace(co_stacksize=9)",
        "jit(_nrt=True)",
        "import os\nos._exit(0)",
        "import atexit\natexit._run_exitfuncs()",
    ],
)
def test_every_way_is_found(code: str) -> None:
    assert list(violations("evoexp/a.py", ast.parse(code), {"_own"}))
