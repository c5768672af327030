"""Documentation: links lead somewhere, commands and code run as they stand, pages are in a menu."""

import contextlib
import functools
import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
import yaml
from joblib.externals.loky import get_reusable_executor

from evoexp.cli import main
from evoexp.commands.command_parser import COMMANDS, command_parser
from evoexp.configuration import expansions
from evoexp.configuration.search_path import options

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])
MENU = ROOT / "scripts/mkdocs.yml"
ELSEWHERE = "tcp:|my_search|HASH"  # a cluster; a package, which `test_new` installs
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)


def blocks(text: str, *languages: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return [block for language, block in found if language in languages]


def commands(page: Path) -> list[list[str]]:
    """Return the words of every evoexp command of a page, without the program's name."""
    found = []
    for block in blocks(page.read_text(), "bash", ""):
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(";|&&", line):
                words = shlex.split(part, comments=True)
                if words and words[0] in ("evoexp", "./scripts/evoexp"):
                    found.append(words[1:])
    return found


def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@each_page
def test_links_lead_to_files_and_headings(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        assert path.exists(), target
        assert not anchor or anchor in anchors(path), target


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_every_page_is_in_the_menu() -> None:
    listed = set(re.findall(r": ([\w./]+\.md)$", MENU.read_text(), flags=re.MULTILINE))
    assert listed == {path.name for path in (ROOT / "docs").glob("*.md")}


def test_the_citation_can_be_read() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["cff-version"] and citation["license"] == "MIT"
    assert len(citation["references"]) == 5
    assert all(reference["authors"] and reference["year"] for reference in citation["references"])


@functools.cache
def experiments() -> frozenset[str]:
    return frozenset(options("experiment"))


def is_elsewhere(words: list[str]) -> bool:
    """Whether a command names files or packages that only the reader has."""
    return any(re.search(r"path/to|PATH|my_|mine|HASH|tcp:|tests/robots|my-", w) for w in words)


@each_page
def test_commands_are_commands(page: Path) -> None:
    for words in commands(page):
        assert words[0] in COMMANDS, words
        command_parser(words[0]).parse_intermixed_args(words[1:])
        if words[0] in ("run", "plan") and not is_elsewhere(words):
            given = [word for word in words[1:] if "=" in word]
            assert expansions.expand(given, multirun="-m" in words)
        named = [w for w in words[1:] if re.fullmatch(r"[a-z]+(_[a-z0-9]+)+", w)]
        assert not named or set(named) <= experiments() or is_elsewhere(words), words


@contextlib.contextmanager
def fresh_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.delenv("EVOEXP_OUTPUTS", raising=False)
    monkeypatch.chdir(tmp_path)
    get_reusable_executor().shutdown(wait=True)  # workers stay in the folder that they began in
    with mpl.rc_context():
        yield tmp_path
    plt.close("all")


@pytest.fixture(scope="module")
def readers_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the runs and files that pages speak of."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "tests").symlink_to(ROOT / "tests")
    (folder / "PATH").symlink_to(ROOT / "src/evoexp/assets/motionbenchmaker")
    (folder / "thesis.mplstyle").write_text("font.family: serif\n")
    for name in ("path/to", "my_options/experiment", "my_options/ga"):
        (folder / name).mkdir(parents=True)
    (folder / "my_options/ga/gentle.yaml").write_text(
        (ROOT / "conf/ga/rana_planar.yaml").read_text()
    )
    for path in ("path/to/mine.yaml", "my_options/experiment/mine.yaml"):
        (folder / path).write_text((ROOT / "conf/experiment/rana_planar.yaml").read_text())
    with pytest.MonkeyPatch.context() as patch, fresh_folder(folder, patch):
        assert main(["run", "experiment=rana_planar"]) == 0
        assert main(["pack", "4da921", "-o", "path/to/runs.tar"]) == 0
        log = next(Path("outputs/runs").glob("4da921*")) / "replicates/0007.mcap"
        Path("path/to/0007.mcap").write_bytes(log.read_bytes())
    return folder


def shortened(words: list[str]) -> list[str]:
    """Return a command with which a long run is over in seconds."""
    is_long = words[0] == "run" and not {"experiment=rana_planar", "-m"} & set(words)
    is_short = any(word.startswith("budget=") for word in words)
    return [*words, "budget=smoke", "num_replicates=1"] if is_long and not is_short else words


@pytest.mark.matrix
@each_page
def test_every_command_can_be_run(
    page: Path, readers_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = [words for words in commands(page) if not re.search(ELSEWHERE, " ".join(words))]
    if not found or page.name == "README.md":
        pytest.skip("no commands, or run in a folder of their own")
    folder = shutil.copytree(readers_folder, tmp_path / "reader", symlinks=True)
    with fresh_folder(folder, monkeypatch):
        for words in found:
            assert main(shortened(words)) == (words[0] == "diff"), words


@pytest.mark.matrix
def test_the_readmes_commands_run_as_they_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with fresh_folder(tmp_path, monkeypatch):
        found = commands(ROOT / "README.md")
        assert len(found) >= 8
        for words in found:
            assert main(words) == 0, words
        assert (tmp_path / "outputs/reports/index.html").is_file()


@each_page
def test_code_runs_as_it_stands(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = blocks(page.read_text(), "python")
    if not code:
        pytest.skip("no code")
    with fresh_folder(tmp_path, monkeypatch):
        assert main(["run", "experiment=rana_planar", "budget=smoke", "--no-report"]) == 0
        names: dict[str, object] = {}
        for block in code:
            exec(compile(block, page.name, "exec"), names)


def test_the_notebook_remakes_a_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = json.loads((ROOT / "docs/remake_a_figure.ipynb").read_text())
    with fresh_folder(tmp_path, monkeypatch):
        assert main(["run", "experiment=rana_planar", "budget=smoke", "--no-report"]) == 0
        names: dict[str, object] = {}
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                assert not cell["outputs"]
                exec(compile("".join(cell["source"]), "notebook", "exec"), names)
        assert (tmp_path / "convergence.svg").stat().st_size > 10_000
