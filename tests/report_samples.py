"""Small experiments to report on."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.report.figures import style
from evoexp.report.pages import build
from evoexp.report.pages.page_builder import PageBuilder, family_comparisons
from evoexp.report.pages.page_file import Functions, Scope, read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings, page_registration
from evoexp.report.results.planner_runs import PlannerRuns, Problem
from evoexp.report.results.stored_results import ConditionResults, Results, gather
from evoexp.report.statistics.judging import Hearing, Judge, Rule
from evoexp.store.identity import manifest
from evoexp.store.run_directory import RunDirectory

SMALL = ("budget=smoke", "ga.population_size=12", "ga.num_generations=4", "num_replicates=2")
REPORT = {
    **{"formats": ("svg", "png"), "dpi": 60, "confidence": 0.95, "significance": 0.05},
    **{"num_resamples": 200, "samples_per_segment": 10, "threshold_ratio": 1.25},
}


def hearing(kind: str, significance: float = 0.05) -> Hearing:
    """Return the hearing of a claim of this kind."""
    return Hearing(Rule("told", "", "", kind, "", "", {}, ()), "", significance)


def expand(name: str, *overrides: str) -> Experiment:
    """Return an experiment, small."""
    words = {word.split("=")[0]: word for word in (*SMALL, *overrides)}
    return compose.expand([f"experiment={name}", *words.values()])[0]


def store(outputs: Path, experiment: Experiment) -> None:
    """Run and store every replicate of an experiment."""
    for label, condition in experiment.conditions:
        run = RunDirectory(outputs, condition.id)
        taken = {
            o.group: {"name": o.name, "origin": o.origin} for o in experiment.options.get(label, ())
        }
        notes = manifest(condition.id) | {"label": label, "options": taken}
        run.create(condition.to_json(), notes, condition.files())
        for replicate in range(condition.num_replicates(experiment.num_replicates)):
            run.write_logs({replicate: run_replicate(condition, replicate).content})


@functools.cache
def smoke_experiment(name: str, *overrides: str) -> Experiment:
    """Return an experiment with two replicates of ten generations, composed once."""
    return compose.expand([f"experiment={name}", "budget=smoke", *overrides])[0]


@functools.cache
def smoke_results(outputs: Path, name: str, *overrides: str) -> Results:
    """Return what two replicates of every condition gave."""
    experiment = smoke_experiment(name, *overrides)
    store(outputs, experiment)
    return gathered(outputs, experiment)


def gathered(outputs: Path, experiment: Experiment) -> Results:
    count, name, budget = experiment.num_replicates, experiment.name, experiment.budget
    return gather(outputs, experiment.conditions, count, name, budget, "")


def made_up(experiment: Experiment, columns: Callable[[str], dict[str, Any]]) -> Results:
    """Return results in which the runs of every condition have these columns, by its label."""
    found = []
    for label, condition in experiment.conditions:
        rows = pd.DataFrame(columns(label))
        found.append(ConditionResults(label, condition, len(rows), rows, {}, None, {}))
    return Results(experiment.name, experiment.budget, tuple(found))


def shown_run(
    label: str, hash12: str, costs: Sequence[float], reasons: Sequence[str] = ()
) -> ConditionResults:
    """Return a run whose certified replicates have these costs; the others failed."""
    condition: Any = SimpleNamespace(id=hash12.ljust(64, "0"), seed=0, is_reference=False)
    rows = pd.DataFrame({"best_cost": costs, "certified": [True] * len(costs)})
    failures = dict(enumerate(reasons, len(costs)))
    run = RunDirectory(Path("outputs"), condition.id)
    return ConditionResults(label, condition, len(rows), rows, failures, run, {})


def made_up_runs(
    planner: str, problem: str, rows: list[tuple[int, float, float]], spent: Sequence[float]
) -> PlannerRuns:
    """Return runs with proven answers: replicate, collision queries, length; and all queries."""
    table = pd.DataFrame(rows, columns=["replicate", "collision_queries", "length"])
    seeds, effort = tuple(range(len(spent))), np.array(spent)
    whole = table.assign(certified=True)
    return PlannerRuns(
        planner, Problem(problem), f"{problem}, {planner}", whole, seeds, effort, None
    )


def page_settings(name: str, figures: str | None = None) -> ReportSettings:
    """Return settings for an experiment's own page, or another one."""
    pages = {"formats": ("svg",), "figures": figures or smoke_experiment(name).report.figures}
    return ReportSettings(**REPORT | pages)  # type: ignore[arg-type]


def page_claims(
    page: str, results: Results, reason: str | None = "", **functions: Callable[..., Any]
) -> list[Claim]:
    """Return the claims of a page, with other functions of these names.

    They are not judged for this reason; None: judged as the results are.
    """
    settings = page_settings("", page)
    own = read_page_file(page_registration(settings).target.partition(":")[0])
    file = own._replace(functions=Functions({**own.functions, **functions}))
    values: dict[str, Any] = {"results": results, "settings": settings, "rules": file.rules}
    if reason is not None:
        values["judge"] = Judge(reason, settings, file.rules)
    entry = file.entries["pages"][page]
    scope = Scope(file.functions, {**values, "paper": file.name})
    compared = family_comparisons(scope, entry)
    return list(PageBuilder(file, scope.inner(compared=compared)).claims(entry["claims"]))


def smoke_report(outputs: Path, name: str, **changed: Any) -> Path:
    """Return the directory of a whole report; some settings of it may be changed."""
    smoke_results(outputs, name)
    experiment = smoke_experiment(name)
    settings = page_settings(name).model_copy(update=changed)
    planned = experiment.conditions, settings, experiment.num_replicates
    request = build.Request(experiment.report_name, name, experiment.budget, *planned, name)
    return request.write(outputs).parent


def figure_stems(directory: Path) -> set[str]:
    """Return the names of a report's figures."""
    return {path.stem for path in directory.glob("*.svg")}


def can_be_drawn(table: pd.DataFrame, draw: Callable[[pd.DataFrame], Figure]) -> bool:
    """Return whether there is a picture of a table."""
    return len(style.drawn(lambda: draw(table), ("svg",), 60)["svg"]) > 1000


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return outputs that hold two experiments; not to be changed."""
    outputs = tmp_path_factory.mktemp("outputs")
    store(outputs, expand("rana_planar"))
    store(outputs, expand("rana_three_arms", "scenario=rana_three_arms"))
    return outputs


@pytest.fixture(scope="session")
def results(stored: Path) -> Results:
    """Return what is stored of the two planar arms and of random search beside them."""
    return gathered(stored, expand("rana_planar"))


@pytest.fixture
def settings() -> ReportSettings:
    """Return settings of the paper's own page."""
    return ReportSettings(**REPORT, figures="rana")
