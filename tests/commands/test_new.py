"""`evoexp new` writes a package that is found, runs, and keeps its obligations."""

import json
import re
import shutil
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

import pytest
from command_samples import Evoexp, exit_code

from evoexp.batch.replicate import run_replicate
from evoexp.configuration.search_path import find, options
from evoexp.evolution.operators.operator import Crossover
from evoexp.registry import component_class
from evoexp.store.log_reader import read_log
from evoexp.testing import CHECKS, Check, check_operator, conditions
from guests import on_path, write_distribution
from test_house import NUMBER, SOURCE

Refused = Callable[..., str]
NAME = "lambda_search"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("guests")
    assert exit_code("new", "planner", NAME, "--directory", str(directory)) == 0
    return directory / NAME


def entry_points(package: Path) -> dict[str, dict[str, str]]:
    """Return the entry points that a package's pyproject.toml declares, by their groups."""
    points = tomllib.loads((package / "pyproject.toml").read_text())["project"]["entry-points"]
    return {group.removeprefix("evoexp."): names for group, names in points.items()}


@pytest.fixture(scope="module")
def installed(package: Path) -> Iterator[None]:
    """Have the package on the path with its entry points."""
    write_distribution(package / "src", NAME, "0.1.0", **entry_points(package))
    with on_path(package / "src"):
        yield


def test_the_files_have_the_new_name_everywhere(package: Path) -> None:
    for path in (path for path in package.rglob("*") if path.is_file()):
        assert not re.search("my_planner|MyPlanner", f"{path}{path.read_text()}")
    for path in ("README.md", "pyproject.toml", f"src/{NAME}/planner.py", f"tests/test_{NAME}.py"):
        assert (package / path).is_file()
    for group in ("experiment", "ga", "planner"):
        assert (package / f"src/{NAME}/conf/{group}/{NAME}.yaml").is_file()


def test_every_number_has_unit_and_source(package: Path) -> None:
    for path in package.rglob("*.yaml"):
        for line in path.read_text().splitlines():
            code, _, comment = line.partition("#")
            value = re.sub(r"\"[^\"]*\"|=\S*", "", code.partition(":")[2])
            assert not NUMBER.search(value) or SOURCE.match("#" + comment), f"{path.name}: {line}"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("label", ["λ = 4", "λ = 16", "random search"])
def test_it_keeps_a_planners_obligations(check: Check, label: str) -> None:
    found = conditions(f"experiment={NAME}")
    assert len(found) == 3
    check(found[label])


PAGE = """
from evoexp.report.pages.page_builder import own_page

def page(results, settings):
    print("the guest's page")
    return own_page("generic", results, settings)
"""


@pytest.mark.usefixtures("wide_terminal")
def test_its_runs_are_recorded_reproduced_and_reported_under_its_name(
    evoexp: Evoexp, outputs: Path, tmp_path: Path
) -> None:
    name = "mu_search"
    assert exit_code("new", "planner", name, "--directory", str(tmp_path)) == 0
    site = tmp_path / name / "src"
    (site / name / "page.py").write_text(PAGE)
    report = Path(find("report", "paper").path).read_text()
    (site / name / "conf" / "report").mkdir()
    own = report.replace("figures: null", f"figures: {name}_page")
    (site / name / "conf" / "report" / f"{name}.yaml").write_text(own)
    points = entry_points(tmp_path / name) | {"pages": {f"{name}_page": f"{name}.page:page"}}
    write_distribution(site, name, "0.3", **points)
    with on_path(site):
        assert find("planner", name).origin == find("experiment", name).origin == f"{name} 0.3"
        assert {name, "rana_planar"} <= set(options("experiment"))
        words = (f"report={name}", "budget=smoke", "num_replicates=1", "runner=serial")
        assert (
            "the guest's page" in evoexp("run", f"experiment={name}", "--only", "λ = 4", *words).out
        )
        (log,) = outputs.glob("runs/*/replicates/*.mcap")
        manifest = json.loads((log.parents[1] / "manifest.json").read_text())
        components = manifest["components"]
        assert components == read_log(log).environment["components"]
        assert components == dict.fromkeys((name, f"{name}_settings"), f"{name} 0.3")
        assert manifest["options"]["planner"] == {"name": name, "origin": f"{name} 0.3"}
        assert manifest["options"]["collision"] == {"name": "rana_planar", "origin": "evoexp"}
        assert evoexp("reproduce", str(log)).code == 0
    # another version is said, and compared
    shutil.rmtree(site / f"{name}-0.3.dist-info")
    write_distribution(site, name, "0.4", **points)
    with on_path(site):
        assert evoexp("reproduce", str(log)).code == 0
    # without the package, its name is said
    shutil.rmtree(site / f"{name}-0.4.dist-info")
    with on_path(site):
        said = evoexp("reproduce", str(log))
    missing = f"needs {name} 0.3, which is not installed"
    assert (said.code, said.err) == (2, f"evoexp: {log}: {missing}\n")


def test_an_operator_enters_the_planners_of_the_papers(evoexp: Evoexp, tmp_path: Path) -> None:
    assert exit_code("new", "operator", "half_swap", "--directory", str(tmp_path)) == 0
    package = tmp_path / "half_swap"
    for path in (path for path in package.rglob("*") if path.is_file()):
        assert not re.search("my_operator|MyOperator", f"{path}{path.read_text()}")
    write_distribution(package / "src", "half_swap", "0.1.0", **entry_points(package))
    with on_path(package / "src"):
        check_operator(cast(Crossover, component_class("half_swap")()))
        for experiment in ("rana_planar", "curkovic_methods", "lavoie_7dof"):
            own, guest = (
                next(iter(conditions(f"experiment={experiment}", *words).values()))
                for words in ((), ("ga.crossover={_target_: half_swap, share: 0.25}",))
            )
            named = {"_target_": "half_swap", "revision": 1, "share": 0.25}
            assert guest.planner.canonical()["ga"]["crossover"] == named
            summaries = [run_replicate(each, 0).summary for each in (own, guest, guest)]
            assert summaries[0].digest != summaries[1].digest == summaries[2].digest
        (guest, *_) = conditions("experiment=lavoie_7dof", "ga.crossover=half_swap").values()
        assert guest.planner.ga.crossover.share == 0.5


def test_a_paper_runs_is_judged_and_drawn(evoexp: Evoexp, tmp_path: Path) -> None:
    """At the paper's budget: a guest's experiment is in no shipped table."""
    assert exit_code("new", "paper", "swarms", "--directory", str(tmp_path)) == 0
    package = tmp_path / "swarms"
    for path in (path for path in package.rglob("*") if path.is_file()):
        assert not re.search("my_p(lanner|aper)|MyP(lanner|aper)", f"{path}{path.read_text()}")
    points = tomllib.loads((package / "pyproject.toml").read_text())["project"]["entry-points"]
    groups = {group.removeprefix("evoexp."): names for group, names in points.items()}
    write_distribution(package / "src", "swarms", "0.1.0", **groups)
    with on_path(package / "src"):
        for word in ("experiment=swarms", "experiment=swarms_claims"):
            assert evoexp("run", word).code == 0
        rows = {row["name"]: row for row in json.loads(evoexp("claims", "swarms", "--json").out)}
        assert rows["free"]["verdict"].startswith("depends on the reading (reproduced under 3 of 4")
        assert rows["better_than_chance"]["verdict"] == "reproduced"
        changed = evoexp("run", "experiment=swarms", "ga.num_generations=3")
        page = Path(changed.out.split("report: ")[1].strip()).with_name("index.md").read_text()
        assert "not judged (settings overridden)" in page
        assert "**reproduced**" not in page


WORD = "a word of lower-case letters, digits and _ that begins with a letter"
USED = "a new name: a component or option has it already"
NAMES = dict.fromkeys(
    ("My_planner", "4arms", "my-planner", "my__planner", "class", "a/b", ""), WORD
)
NAMES |= {"coevolution": USED, "rana": USED, "evoexp": "a new name"}
NAMES["json"] = "json: a module of this name is installed; choose another NAME"


@pytest.mark.parametrize("name", NAMES)
def test_names_that_cannot_be(refused: Refused, tmp_path: Path, name: str) -> None:
    assert NAMES[name] in refused("new", "planner", name, "--directory", str(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_stays(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    said = refused("new", "planner", "mine", "--directory", str(tmp_path))
    assert said == f"{tmp_path}/mine: is there already; choose another NAME or --directory"
    assert list((tmp_path / "mine").iterdir()) == []
