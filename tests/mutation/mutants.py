"""Mutants: one small change at a border of the code, drawn from all of `src` with a seed.

Why our own: mutmut 3 changes functions without decorators only, so no kernel; cosmic-ray runs one
test command for all mutants and draws none. Both would need as much around them as this file holds.
"""

import ast
import itertools
import random
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

PACKAGE = Path("src/evoexp")
HERE = Path(__file__).parent

_COMPARISONS = [(ast.Lt, ast.LtE), (ast.Gt, ast.GtE), (ast.Eq, ast.NotEq), (ast.In, ast.NotIn)]
_OPERATORS = [*_COMPARISONS, (ast.Is, ast.IsNot), (ast.And, ast.Or), (ast.Add, ast.Sub)]
FLIPPED: dict[type, Any] = dict(_OPERATORS) | {two: one for one, two in _OPERATORS}
_EXTREMES = [("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all")]
OPPOSITES = dict(_EXTREMES) | {two: one for one, two in _EXTREMES}
INDICES = {"-1": "0", "0": "-1", "1": "0", "1:": ":", ":-1": ":", "-1:": "-2:", ":1": ":2"}
MOTION = re.compile(r"\boM[if]\b|placement\b|\.inverse\(\)")  # a factor whose order counts
# A mutant of these could end processes or remove files outside of its copy.
HARMFUL = re.compile(r"\b(kill\w*|rmtree|unlink|rmdir|removedirs|remove|parents|setrlimit)\b")


class Mutant(NamedTuple):
    """One change of one file."""

    file: str  # relative to the tree
    line: int
    start: int  # [characters] of the replaced text within the file
    end: int
    text: str  # which replaces it
    before: str  # the changed lines, on one line
    after: str

    def __str__(self) -> str:
        """Describe the change on one line."""
        return f"{self.file}:{self.line}: {self.before} → {self.after}"

    def applied(self, source: str) -> str:
        """Return the file's text with the change made."""
        return source[: self.start] + self.text + source[self.end :]


def changed_text(file: str, source: str, start: int, end: int, text: str) -> Mutant:
    """Make the mutant that replaces a part of a file's text."""
    first = source.rfind("\n", 0, start) + 1
    last = source.find("\n", end) if "\n" in source[end:] else len(source)
    before, after = source[first:last], source[first:start] + text + source[end:last]
    line = source.count("\n", 0, start) + 1
    words = (" ".join(lines.split()) for lines in (before, after))
    return Mutant(file, line, start, end, text, *words)


def mutants_of(file: str, source: str) -> Iterator[tuple[str, Mutant]]:
    """Yield (kind, mutant) for every border in a file."""
    lines = source.splitlines(keepends=True)
    starts = list(itertools.accumulate(map(len, lines), initial=0))

    def place(line: int | None, column: int | None) -> int:  # ast counts bytes of UTF-8
        assert line is not None
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    for kind, node, text in _borders(ast.parse(source)):
        start = place(node.lineno, node.col_offset)
        end = place(node.end_lineno, node.end_col_offset)
        yield kind, changed_text(file, source, start, end, text)


def _borders(node: ast.AST) -> Iterator[tuple[str, ast.expr, str]]:
    """Yield (kind, expression, text instead of it), but for annotations, messages, harmful code."""
    if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr):
        return
    if isinstance(node, ast.FunctionDef) and HARMFUL.search(ast.unparse(node)):
        return
    if isinstance(node, ast.expr):
        for kind, text in _variants(node):
            yield kind, node, text
    values: list[ast.expr | None] = []
    if isinstance(node, ast.FunctionDef):
        values = [*node.args.defaults, *node.args.kw_defaults]
    elif isinstance(node, ast.ClassDef):
        fields = [part for part in node.body if isinstance(part, ast.AnnAssign)]
        values = [part.value for part in fields if "ClassVar" not in ast.unparse(part.annotation)]
    elif isinstance(node, ast.Return):
        values = [node.value]
    for value in values:
        if isinstance(value, ast.Constant) and isinstance(value.value, bool | int | float):
            number = value.value
            other = not number if isinstance(number, bool) else number + 1
            yield "exit code" if isinstance(node, ast.Return) else "default", value, repr(other)
    for name, field in ast.iter_fields(node):
        if name not in ("annotation", "returns", "decorator_list", "bases"):
            for child in field if isinstance(field, list) else [field]:
                if isinstance(child, ast.AST):
                    yield from _borders(child)


def _variants(node: ast.expr) -> Iterator[tuple[str, str]]:
    """Yield (kind, text) of the expressions that an expression may be mistaken for."""
    match node:
        case ast.Compare(left, [operator], [right]):
            yield "comparison", ast.unparse(ast.Compare(left, [FLIPPED[type(operator)]()], [right]))
        case ast.BoolOp(operator, values):
            yield "and/or", f"({ast.unparse(ast.BoolOp(FLIPPED[type(operator)](), values))})"
        case ast.UnaryOp(ast.Not(), operand):
            yield "dropped not", f"({ast.unparse(operand)})"
        case ast.UnaryOp(ast.USub(), operand) if not isinstance(operand, ast.Constant):
            yield "sign", f"({ast.unparse(operand)})"
        case ast.BinOp(left, operator, right):
            swapped = f"({ast.unparse(ast.BinOp(right, operator, left))})"
            is_motion = isinstance(operator, ast.Mult) and MOTION.search(ast.unparse(node))
            if is_motion or isinstance(operator, ast.MatMult):
                yield "order of composition", swapped
            if type(operator) in FLIPPED and not (_is_sequence(left) or _is_sequence(right)):
                flipped = ast.BinOp(left, FLIPPED[type(operator)](), right)
                yield "sign", f"({ast.unparse(flipped)})"
        case ast.Subscript(value, index, ast.Load()):
            parts = index.elts if isinstance(index, ast.Tuple) else [index]
            words = [ast.unparse(part) for part in parts]
            for k, word in enumerate(words):
                if word in INDICES:
                    others = ", ".join([*words[:k], INDICES[word], *words[k + 1 :]])
                    yield "index", f"{ast.unparse(value)}[{others}]"
        case ast.Call(function):
            words = [ast.unparse(word) for word in (*node.args, *node.keywords)]
            yield from _variants_of_call(ast.unparse(function), words)


def _is_sequence(node: ast.expr) -> bool:
    is_text = isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    return is_text or isinstance(node, ast.JoinedStr | ast.List | ast.Tuple)


def _variants_of_call(function: str, words: list[str]) -> Iterator[tuple[str, str]]:
    """Yield (kind, text) of other calls: the opposite function, other bounds, another order."""
    name = function.rpartition(".")[2]
    if name in OPPOSITES:
        other = function.removesuffix(name) + OPPOSITES[name]
        yield "min/max", f"{other}({', '.join(words)})"
    if name in ("range", "prange"):
        last = min(1, len(words) - 1)
        words[last] += " - 1"
        yield "range", f"{function}({', '.join(words)})"
    if name == "sorted" and not any("reverse" in word for word in words):
        yield "order of a sort", f"sorted({', '.join([*words, 'reverse=True'])})"
    if name == "matrix_product":
        yield "order of composition", f"{function}({', '.join(reversed(words))})"


def drawn(tree: Path, seed: int, count: int) -> list[Mutant]:
    """Draw so many mutants of all rooms in turn, and of all kinds that a file has, by a seed."""
    equivalent = {(row["file"], row["before"], row["after"]) for row in entries("equivalent")}
    rooms = defaultdict[str, list[Path]](list)
    for path in sorted((tree / PACKAGE).rglob("*.py")):
        room, *inner = path.relative_to(tree / PACKAGE).parts
        if room != "assets":
            rooms[room if inner else ""].append(path)
    mutants: dict[Mutant, None] = {}  # in the order of the draw
    for place, room in enumerate(itertools.cycle(sorted(rooms))):
        rng = random.Random(f"{seed} {place}")  # an edit elsewhere leaves this draw as it is
        [path] = rng.choices(rooms[room], [file.stat().st_size for file in rooms[room]])
        kinds = defaultdict[str, list[Mutant]](list)
        for kind, mutant in mutants_of(path.relative_to(tree).as_posix(), path.read_text()):
            kinds[kind].append(mutant)
        if kinds:
            [kind] = rng.choices(sorted(kinds))
            [mutant] = rng.choices(kinds[kind])
            if (mutant.file, mutant.before, mutant.after) not in equivalent:
                mutants[mutant] = None
        if len(mutants) == count:
            break
    return list(mutants)


def entries(name: str) -> list[dict[str, str]]:
    """Read a file of changes beside this one: `equivalent` mutants, or `plants` that were made."""
    rows: list[dict[str, str]] = tomllib.loads((HERE / f"{name}.toml").read_text())["mutant"]
    return rows


def plant(tree: Path, row: dict[str, str]) -> Mutant:
    """Make the mutant of a file's entry, whose text must occur once."""
    source = (tree / row["file"]).read_text()
    assert source.count(row["before"]) == 1, f"{row['file']}: must hold once: {row['before']}"
    start = source.index(row["before"])
    return changed_text(row["file"], source, start, start + len(row["before"]), row["after"])
