"""A guest's package: its planner runs, is recorded, reproduced and reported like our own."""

import json
import shutil
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
COMPONENTS = {"my_planner": "my_planner.planner:MyPlanner"}
WORDS = ("budget=smoke", "num_replicates=1", "ga.population_size=8", "ga.num_generations=2")
RUN = ("run", "experiment=my_planner", *WORDS, "planner.num_new_trajectories=1", "runner=serial")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """Write a package with a planner, its options, an experiment and a page; return its folder."""
    package = tmp_path / "site" / "my_planner"
    for group, shipped, old, new in (
        ("planner", "rana_planar", "via_point_ga", "my_planner"),
        ("experiment", "rana_obstacles", "planner: rana_planar", "planner: my_planner"),
        ("report", "paper", "figures: null", "figures: my_planner_page"),
    ):
        (package / "conf" / group).mkdir(parents=True)
        text = Path(find(group, shipped).path).read_text()
        assert old in text
        (package / "conf" / group / "my_planner.yaml").write_text(text.replace(old, new))
    (package / "__init__.py").touch()
    (package / "planner.py").write_text(PLANNER)
    (package / "page.py").write_text(PAGE)
    pages, conf = {"my_planner_page": "my_planner.page:page"}, {"options": "my_planner:conf"}
    write_distribution(
        tmp_path / "site", "my-planner", "0.3", components=COMPONENTS, pages=pages, conf=conf
    )
    return tmp_path / "site"


def test_a_guests_planner_is_run_reproduced_and_reported(
    site: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "outputs"))
    monkeypatch.setenv("COLUMNS", "200")
    with on_path(site):
        for group in ("planner", "experiment"):
            assert find(group, "my_planner").origin == "my-planner 0.3"
        assert {"my_planner", "rana_planar"} <= set(options("experiment"))
        assert main([*RUN, "report=my_planner"]) == 0
        assert "the guest's page" in capsys.readouterr().out
        (log,) = tmp_path.glob("outputs/runs/*/replicates/*.mcap")
        components = {"my_planner": "my-planner 0.3"}
        assert read_log(log).environment["components"] == components
        manifest = json.loads((log.parents[1] / "manifest.json").read_text())
        assert manifest["components"] == components
        options_used = manifest["options"]
        assert options_used["planner"] == {"name": "my_planner", "origin": "my-planner 0.3"}
        assert options_used["ga"] == {"name": "rana_planar", "origin": "evoexp"}
        assert main(["reproduce", str(log)]) == 0
    # another version is said, and compared
    shutil.rmtree(site / "my_planner-0.3.dist-info")
    write_distribution(site, "my-planner", "0.4", components=COMPONENTS)
    with on_path(site):
        assert main(["reproduce", str(log)]) == 0
    # without the package, its name is said
    shutil.rmtree(site / "my_planner-0.4.dist-info")
    capsys.readouterr()
    with on_path(site):
        assert main(["reproduce", str(log)]) == 2
    missing = "needs my-planner 0.3, which is not installed"
    assert capsys.readouterr().err == f"evoexp: {log}: {missing}\n"
