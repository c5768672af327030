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
    "config.CACHE_DIR",  # numba's
    "config.CACHE_LOCATOR_CLASSES",
    "sys.excepthook",
    "sys.stderr",
    "sys.stdin",
    "sys.stdout",
    "sys.unraisablehook",
    "tempfile.tempdir",
    "threading.excepthook",
    "warnings.showwarning",
}
# A worker ends at once when its parent is gone, and a forked one does not end as its parent does.
ENDS_AT_ONCE = re.compile(r"evoexp/batch/\w*worker\w*\.py$")
MODULE_TABLE_CALLS = {"update", "pop", "setdefault", "clear", "popitem"}


def _is_private(name: str) -> bool:
    """Return whether a name begins with one underscore; `_` and `_target_` do not count."""
    return len(name) > 1 and name.startswith("_") and not name.endswith("_")


def _own_names(trees: Iterable[ast.AST]) -> set[str]:
    """Return the underscored names that evoexp defines itself."""
    names = set()
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                names.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                names.add(node.id)
            elif (
                isinstance(node, ast.Attribute)
                and isinstance(node.ctx, ast.Store)
                and isinstance(node.value, ast.Name)
                and node.value.id in ("self", "cls")
            ):
                names.add(node.attr)
    return {name for name in names if _is_private(name)}


def _foreign_names(tree: ast.AST) -> set[str]:
    """Return the names in a file that stand for something of another package."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] != "evoexp":
                    names.add(alias.asname or alias.name.split(".")[0])
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] != "evoexp":
            names.update(alias.asname or alias.name for alias in node.names)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(node.value, ast.Attribute):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if _root(node.value) in names:
                names.update(each.id for each in targets if isinstance(each, ast.Name))
    return names


def _root(node: ast.expr) -> str:
    """Return the name with which a chain of attributes and items begins."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _dotted(node: ast.expr) -> str:
    """Return a chain of names with dots; nothing for any other expression."""
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def violations(path: str, tree: ast.AST, own: set[str]) -> Iterator[str]:
    """Yield what a file does to other packages that it must not do."""
    foreign = _foreign_names(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
            yield from (name for name in modules if any(map(_is_private, name.split("."))))
        elif isinstance(node, ast.ImportFrom):
            if (node.module or "").split(".")[0] != "evoexp":
                parts = [*(node.module or "").split("."), *(alias.name for alias in node.names)]
                yield from filter(_is_private, parts)
        elif isinstance(node, ast.Attribute):
            yield from _of_attribute(node, path, own, foreign)
        elif isinstance(node, ast.Subscript):
            is_changed = isinstance(node.ctx, ast.Store | ast.Del)
            if is_changed and _dotted(node.value) == "sys.modules":
                yield "sys.modules"
        elif isinstance(node, ast.Call):
            yield from _of_call(node, own, foreign)


def _of_attribute(
    node: ast.Attribute, path: str, own: set[str], foreign: set[str]
) -> Iterator[str]:
    root = _root(node)
    if _dotted(node) == "os._exit":
        if not ENDS_AT_ONCE.search(path):
            yield "os._exit"
    elif node.attr in ("ctypes", "co_stacksize"):
        yield node.attr
    elif _is_private(node.attr) and node.attr not in DOCUMENTED:
        if root in foreign or node.attr not in own:
            yield node.attr
    elif isinstance(node.ctx, ast.Store | ast.Del) and root in foreign:
        is_own_module = ast.unparse(node.value) == "sys.modules[__name__]"
        if not is_own_module and _dotted(node) not in SETTINGS:
            yield ast.unparse(node)


def _of_call(node: ast.Call, own: set[str], foreign: set[str]) -> Iterator[str]:
    called = _dotted(node.func)
    yield from (word.arg for word in node.keywords if word.arg == "co_stacksize")
    yield from (word.arg for word in node.keywords if word.arg and _is_undocumented(word.arg, own))
    if called.rpartition(".")[0] == "sys.modules" and node.func.attr in MODULE_TABLE_CALLS:  # type: ignore[attr-defined]
        yield "sys.modules"
    if called in ("getattr", "hasattr", "setattr", "delattr") and len(node.args) > 1:
        name = node.args[1]
        is_text = isinstance(name, ast.Constant) and isinstance(name.value, str)
        if is_text and _is_undocumented(name.value, own):  # type: ignore[attr-defined]
            yield name.value  # type: ignore[attr-defined]
        if called in ("setattr", "delattr") and _root(node.args[0]) in foreign:
            yield called


def _is_undocumented(name: str, own: set[str]) -> bool:
    return _is_private(name) and name not in DOCUMENTED and name not in own


def test_nothing_of_other_packages_is_read_or_replaced() -> None:
    trees = {path: ast.parse(path.read_text()) for path in FILES}
    own, found = _own_names(trees.values()), set()
    for path, tree in trees.items():
        place = path.relative_to(ROOT).as_posix()
        found |= {f"{place}: {name}" for name in violations(place, tree, own)}
    assert not found


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


@pytest.mark.parametrize(
    "code",
    [
        "self._own = value._own",
        "row._asdict()",
        "from evoexp.condition import _x",
        "import os\nos.environ['A'] = 'b'",
        "import sys\nsys.modules.get('x')",
        "import numba\nnumba.__version__",
    ],
)
def test_nothing_else_is(code: str) -> None:
    assert not list(violations("evoexp/a.py", ast.parse(code), {"_own"}))


def test_a_worker_may_end_at_once() -> None:
    tree = ast.parse("import os\nos._exit(1)")
    assert not list(violations("src/evoexp/batch/worker_server.py", tree, set()))
