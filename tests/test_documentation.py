"""Documentation: links lead somewhere, commands and code run as they stand, pages are in a menu."""

import ast
import contextlib
import functools
import json
import re
import shlex
import shutil
from collections.abc import Iterator
from inspect import ismodule
from pathlib import Path
from pkgutil import resolve_name
from typing import NamedTuple

import duckdb
import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
import yaml

from composed import composed, script
from evoexp.cli import main
from evoexp.commands.command_parser import COMMANDS, command_parser
from evoexp.configuration import compose
from evoexp.configuration.search_path import options
from evoexp.registry import CLAIMS, names, registered
from evoexp.report.statistics.judging import registered_rules
from evoexp.version import __version__

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])
MENU = ROOT / "scripts/mkdocs.yml"
NOTEBOOK = ROOT / "docs/remake_a_figure.ipynb"
RUN = {"bash": "commands", "python": "code", "sql": "queries"}  # languages of blocks that are run
FILES = {
    "xml",
    "yaml",
    "csv",
    "ini",
    "python",
    "latex",
}  # of blocks that are files: `title="…"` names each
# Commands that the tests of this module leave out, each with the reason.
LEFT_OUT = {
    "git clone": "only the reader knows the address",
    "cd evoexp": "the same",
    "pip install": "tests/test_guest_package.py installs packages in environments",
    "-m venv": "tests/test_guest_package.py makes environments",
    "my_env/bin/activate": "the same",
    "my_search": "a package that is installed: tests/test_guest_package.py",
    "my_swap": "the same",
    "my_swarm": "the same",
    "HASH": "a run of that package: tests/test_guest_package.py",
    "kuka_kr_210.urdf": "of a clone; scripts/update-gallery plans for it",
    "tcp:": "a cluster: tests/batch/test_cluster.py",
    "scripts/test": "the command that runs this very test",
    "scripts/check-matrix": "other interpreters: tests/reproducibility/test_check_matrix.py",
}
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)


class Block(NamedTuple):
    """A block of a page: its language, the name of the file that it is, its text."""

    language: str
    name: str
    text: str


def blocks(page: Path, *languages: str) -> list[Block]:
    """Return the blocks of a page, or those in some languages."""
    pattern = r'^```(\w*)(?: title="([^"]+)")?\n(.*?)^```$'
    found = re.findall(pattern, page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return [Block(*each) for each in found if not languages or each[0] in languages]


@functools.cache
def lines(page: Path) -> list[str]:
    """Return every command of a page's blocks."""
    found = []
    for block in blocks(page, "bash"):
        for line in block.text.replace("\\\n", " ").splitlines():
            line = re.sub(r'^eval "\$\((.*)\)"', r"\1", line)
            words = shlex.join(shlex.split(line, comments=True))
            found += [part.strip() for part in re.split(r"';'|;|'&&'|&&", words)]
    return [line for line in found if line]


def commands(page: Path) -> list[list[str]]:
    """Return the words of every evoexp command of a page, without the program's name."""
    every = [shlex.split(line) for line in lines(page)]
    return [words[1:] for words in every if words[0] in ("evoexp", "./scripts/evoexp")]


def without_blocks(page: Path) -> str:
    return re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)


def write_files(page: Path, folder: Path) -> None:
    """Write the files that a page shows."""
    for block in (block for block in blocks(page, *FILES) if block.name):
        path = folder / block.name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text)


def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@each_page
def test_links_lead_to_files_and_headings(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", without_blocks(page)):
        if not target.startswith("http"):
            name, _, anchor = target.partition("#")
            path = (page.parent / name).resolve() if name else page
            assert path.exists(), target
            assert not anchor or anchor in anchors(path), target


@each_page
def test_every_block_is_run_or_is_a_file_and_every_command_is_one(page: Path) -> None:
    for block in blocks(page):
        assert block.language in (FILES if block.name else RUN), block
    outside = without_blocks(page)
    assert "```" not in outside
    assert not re.findall(r"^\n(?: {4,}|\t)\S.*", outside, flags=re.MULTILINE)  # by indentation
    for name in re.findall(r"`(?:\./scripts/)?evoexp ([^\s`]+)[^`]*`", outside):
        assert name in COMMANDS, name
    for line in lines(page):
        is_ours = shlex.split(line)[0] in ("evoexp", "./scripts/evoexp")
        assert is_ours or any(part in line for part in LEFT_OUT), line


def test_every_reason_is_needed() -> None:
    every = "\n".join(line for page in PAGES for line in lines(page))
    assert [part for part in LEFT_OUT if part not in every] == []


def test_the_readme_is_short_every_page_in_the_menu_and_the_citation_right() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120
    listed = set(re.findall(r": ([\w./]+\.md)$", MENU.read_text(), flags=re.MULTILINE))
    assert listed == {path.name for path in (ROOT / "docs").glob("*.md")}
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["cff-version"] and citation["license"] == "MIT"
    assert citation["version"] == __version__
    assert len(citation["references"]) == 5
    assert all(reference["authors"] and reference["year"] for reference in citation["references"])


def is_elsewhere(words: list[str]) -> bool:
    """Whether a command names files or packages that only the reader has."""
    return any(
        re.search(r"path/to|PATH|my_|mine|HASH|tcp:|arm.urdf|kuka_|[.]csv", w) for w in words
    )


def is_no_experiment(word: str) -> bool:
    return re.fullmatch(r"experiment=\w+", word) is None


@each_page
def test_commands_are_commands(page: Path) -> None:
    for words in commands(page):
        assert words[0] in COMMANDS, words
        command_parser(words[0]).parse_intermixed_args(words[1:])
        if words[0] in ("run", "plan") and not is_elsewhere(words):
            given = sorted((word for word in words[1:] if "=" in word), key=is_no_experiment)
            is_one = "-m" not in words and not is_no_experiment(given[0])
            assert composed(*given) if is_one else compose.expand(given, multirun="-m" in words)
        named = [w for w in words[1:] if re.fullmatch(r"[a-z]+(_[a-z0-9]+)+", w)]
        assert not named or set(named) <= set(options("experiment")) or is_elsewhere(words), words


@contextlib.contextmanager
def fresh_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.delenv("EVOEXP_OUTPUTS", raising=False)
    monkeypatch.chdir(tmp_path)
    with mpl.rc_context():
        yield tmp_path
    plt.close("all")


@pytest.fixture(scope="module")
def readers_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the runs and files that pages speak of."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "path/to").mkdir(parents=True)
    (folder / "path/to/problems").symlink_to(ROOT / "src/evoexp/assets/motionbenchmaker/problems")
    own = (ROOT / "conf/experiment/rana_planar.yaml").read_text()
    (folder / "path/to/mine.yaml").write_text(own)
    with pytest.MonkeyPatch.context() as patch, fresh_folder(folder, patch):
        assert main(["run", "experiment=rana_planar"]) == 0
        assert main(["pack", "4da921", "-o", "path/to/runs.tar"]) == 0
        log = next(Path("outputs/runs").glob("4da921*")) / "replicates/0007.mcap"
        Path("path/to/0007.mcap").write_bytes(log.read_bytes())
    return folder


ONE_OF_MANY = {  # conditions: tests/test_shipped.py runs every one of them
    "experiment=arena_papers": "rana_planar · GA",
    "experiment=arena_tuning": "curkovic_b",
}


def shortened(words: list[str]) -> list[str]:
    """Return a command with which a long run is over in seconds."""
    words = [*words, "sweep.num_trials=1"] if "sweep=optuna" in words else words
    is_short = "experiment=rana_planar" in words or (
        "-m" in words and not {*words} & {*ONE_OF_MANY}
    )
    is_long = words[0] == "run" and not is_short
    if is_long and not any(word.startswith("budget=") for word in words):
        names = [ONE_OF_MANY[word] for word in words if word in ONE_OF_MANY]
        words = [word for word in words if not word.startswith("num_replicates=")]
        return [*words, "budget=smoke", "num_replicates=1", *(["--only", *names] if names else [])]
    # a comparison of what was run above, at that budget
    is_of_page = words[0] == "compare" and "rana_planar" not in words
    return [*words, "budget=smoke"] if is_of_page else words


@pytest.mark.matrix
@each_page
def test_every_command_can_be_run(
    page: Path, readers_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    others = ("my_search", "my_swap", "my_swarm", "HASH", "tcp:")
    every = [words for words in commands(page) if not any(o in " ".join(words) for o in others)]
    if not every or page.name == "README.md":
        pytest.skip("no commands, or run as they stand, in an empty folder, by the next test")
    folder = shutil.copytree(readers_folder, tmp_path / "reader", symlinks=True)
    write_files(page, folder)
    with fresh_folder(folder, monkeypatch):
        for words in every:
            assert main(shortened(words)) == (words[0] == "diff"), words


@pytest.mark.matrix
@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "docs/index.md"], ids=lambda p: p.name)
def test_first_commands_run_as_they_stand(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with fresh_folder(tmp_path, monkeypatch):
        assert len(commands(page)) >= 5
        for words in commands(page):
            assert main(words) == 0, words
        assert (tmp_path / "outputs/reports/index.html").is_file()


@pytest.mark.parametrize("page", [*PAGES, NOTEBOOK], ids=lambda path: path.name)
def test_code_and_queries_run_as_they_stand(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if page == NOTEBOOK:
        cells = [c for c in json.loads(page.read_text())["cells"] if c["cell_type"] == "code"]
        assert not any(cell["outputs"] for cell in cells)
        code = [Block("python", "", "".join(cell["source"])) for cell in cells]
    elif not (code := [block for block in blocks(page, "python", "sql") if not block.name]):
        pytest.skip("no code")
    with fresh_folder(tmp_path, monkeypatch):
        assert main(["run", "experiment=rana_planar", "budget=smoke", "--no-report"]) == 0
        names: dict[str, object] = {"__name__": "__main__"}  # as in a script
        for block in code:
            if block.language == "sql":
                assert duckdb.sql(block.text).fetchall(), block.text
            else:
                exec(compile(block.text, page.name, "exec"), names)
        assert page != NOTEBOOK or Path("convergence.svg").stat().st_size > 10_000


@pytest.mark.parametrize("paper", names(CLAIMS))
def test_verdicts_of_a_paper_are_those_that_are_stored(paper: str) -> None:
    update = script("update-verdicts")
    stored = json.loads(update.STORED.read_text(encoding="utf-8"))[paper]
    page = (ROOT / f"docs/paper_{paper}.md").read_text(encoding="utf-8")
    assert page == update.with_table(page, stored), "run: scripts/update-verdicts"
    claims = registered_rules(registered(CLAIMS, paper))
    assert stored and {row["name"] for row in stored} <= {*claims}, "run: scripts/update-verdicts"


def test_figures_of_the_architecture_are_those_of_the_imports(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    update = script("update-architecture")
    stored = {path.name: path.read_text(encoding="utf-8") for path in update.FIGURES.iterdir()}
    assert update.figures() == stored, "run: scripts/update-architecture"
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    assert all(f"| `{path.parent.name}` |" in page for path in update.SOURCE.glob("*/__init__.py"))
    wrong = update.Station(0, "cli.py", ""), update.Station(1, "condition.py", "", "Batch")
    monkeypatch.setattr(update, "WAYS", {"log": wrong})
    assert update.main([]) == 2
    must = "error: log: cli.py must import Batch from condition.py, imports nothing\n"
    assert capsys.readouterr().err == must


def imported(code: str) -> Iterator[str]:
    """Yield the names of evoexp that code imports; of a module that it imports those it uses."""
    for node in ast.walk(ast.parse(code)):
        module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
        for alias in node.names if isinstance(node, ast.Import | ast.ImportFrom) else ():
            if (name := f"{module}{alias.name}").split(".")[0] == "evoexp":
                members = re.findall(rf"\b{alias.name}\.(\w+)", code)
                is_module = ismodule(resolve_name(name))
                yield from (f"{name}.{member}" for member in members) if is_module else [name]


def test_api_pages_name_what_guests_use_and_nothing_else() -> None:
    code = [path.read_text() for path in ROOT.glob("src/evoexp/assets/new_*/**/*.py")]
    code += [block.text for page in PAGES for block in blocks(page, "python")]
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    code += ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    used = {id(resolve_name(name)): name for text in code for name in imported(text)}
    pages = "".join(page.read_text() for page in PAGES if page.name != "changelog.md")
    shown = re.findall(r"^::: (\S+)(?:\n +options: {members: \[(\w+)\]})?", pages, re.MULTILINE)
    entries = [f"{n}.{m}" if ismodule(resolve_name(n)) else n for n, m in shown]
    objects = {id(resolve_name(name)): name for name in entries}
    assert [name for key, name in used.items() if key not in objects] == []
    # a page says what the others are for
    named = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", pages))))
    others = [objects[key].split(".")[-1] for key in objects.keys() - used.keys()]
    assert [name for name in others if name not in named] == []
