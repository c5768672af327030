"""A guest's package: its planner runs, is recorded, reproduced and reported like our own."""

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from evoexp.cli import main
from evoexp.configuration.search_path import find, options
from evoexp.store.log_reader import read_log
from guests import on_path, write_distribution

PLANNER = """
from typing import ClassVar
from evoexp.planners.via_point_ga.planner import ViaPointGa

class MyPlanner(ViaPointGa):
    component: ClassVar[str] = "my_planner"
    revision: ClassVar[int] = 1
"""
PAGE = """
from evoexp.report.pages.generic import page as generic

def page(results, settings):
    built = generic(results, settings)
    print("the guest's page")
    return built
"""
WORDS = ("budget=smoke", "num_replicates=1", "ga.population_size=8", "ga.num_generations=2")
RUN = ("run", "experiment=my_planner", *WORDS, "planner.num_new_trajectories=1", "runner=serial")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """Write a package with a planner, its options, an experiment and a page; return its folder."""
    package = tmp_path / "site" / "my_planner"
    for group, change in (("planner", "via_point_ga"), ("experiment", "planner: rana_planar")):
        (package / "conf" / group).mkdir(parents=True)
        shipped = {"planner": "rana_planar", "experiment": "rana_obstacles"}[group]
        text = Path(find(group, shipped).path).read_text()
        assert change in text
        text = text.replace(change, change.replace("via_point_ga", "my_planner"))
        text = text.replace("/planner: rana_planar", "/planner: my_planner")
        (package / "conf" / group / "my_planner.yaml").write_text(text)
    (package / "conf" / "report").mkdir()
    report = Path(find("report", "paper").path).read_text()
    (package / "conf/report/my_planner.yaml").write_text(
        report.replace("figures: null", "figures: my_planner_page")
    )
    (package / "__init__.py").touch()
    (package / "planner.py").write_text(PLANNER)
    (package / "page.py").write_text(PAGE)
    write_distribution(
        tmp_path / "site",
        "my-planner",
        "0.3",
        components={"my_planner": "my_planner.planner:MyPlanner"},
        pages={"my_planner_page": "my_planner.page:page"},
        conf={"options": "my_planner:conf"},
    )
    return tmp_path / "site"


@pytest.fixture
def installed(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., int]]:
    """Install the package, with outputs of this test's own."""
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "outputs"))
    monkeypatch.setenv("COLUMNS", "200")
    with on_path(site):
        yield lambda *words: main(words)


def test_a_guests_planner_is_run_reproduced_and_reported(
    installed: Callable[..., int],
    site: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    assert (
        find("planner", "my_planner").origin
        == find("experiment", "my_planner").origin
        == "my-planner 0.3"
    )
    assert {"my_planner", "rana_planar"} <= set(options("experiment"))
    assert installed(*RUN, "report=my_planner") == 0
    assert "the guest's page" in capsys.readouterr().out
    (log,) = tmp_path.glob("outputs/runs/*/replicates/*.mcap")
    components = {"my_planner": "my-planner 0.3"}
    assert read_log(log).environment["components"] == components
    manifest = json.loads((log.parents[1] / "manifest.json").read_text())
    assert manifest["components"] == components
    assert manifest["options"]["planner"] == {"name": "my_planner", "origin": "my-planner 0.3"}
    assert manifest["options"]["ga"] == {"name": "rana_planar", "origin": "evoexp"}
    assert installed("reproduce", str(log)) == 0

    # another version is said, and compared
    shutil.rmtree(site / "my_planner-0.3.dist-info")
    write_distribution(
        site, "my-planner", "0.4", components={"my_planner": "my_planner.planner:MyPlanner"}
    )
    with on_path(site):
        assert main(["reproduce", str(log)]) == 0

    # without the package, its name is said
    shutil.rmtree(site / "my_planner-0.4.dist-info")
    capsys.readouterr()
    with on_path(site):
        assert main(["reproduce", str(log)]) == 2
    assert capsys.readouterr().err == (
        f"evoexp: {log}: needs my-planner 0.3, which is not installed\n"
    )
