"""Searches of settings, `sweep=optuna`: what is proposed, how it is judged, how it goes on."""

import re
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_samples import Evoexp
from filelock import FileLock

from evoexp import load
from evoexp.configuration.compose import expand

EXPERIMENT = ("experiment=rana_planar", "budget=smoke", "runner=serial", "ga.num_generations=4")
SPACE = ("ga.population_size=int(interval(7,12))", "ga.num_elites=0,2,9")
SPACE += ("planner.walk_step=tag(log,interval(0.5,8))", "planner.num_new_trajectories=range(0,3)")
WORDS = (*EXPERIMENT, *SPACE, "sweep=optuna", "--only", "via-point GA")
NO_REPORT = ("--no-report",)


def trials(text: str) -> list[str]:
    return re.findall(
        r"^trial [1-9].* · .*$", text.replace(" of 6:", ":").replace(" of 3:", ":"), re.M
    )


def test_a_search_goes_on_as_if_it_had_not_been_interrupted(evoexp: Evoexp, outputs: Path) -> None:
    half = evoexp("run", *WORDS, "sweep.num_trials=3", *NO_REPORT)
    rest = evoexp("run", *WORDS, "sweep.num_trials=6", *NO_REPORT)
    assert half.code == rest.code == 0
    (folder,) = (outputs / "searches").iterdir()
    with FileLock(folder / ".lock"):  # as another process holds it
        busy = evoexp("run", *WORDS, "sweep.num_trials=7", *NO_REPORT)
    assert busy.code == 2 and "another process goes on with this search now" in busy.err
    (folder / "journal.log").unlink()
    whole = evoexp("run", *WORDS, "sweep.num_trials=6")
    found = trials(whole.out)
    assert whole.code == 0, whole.err
    assert found == trials(half.out) + trials(rest.out) and len(found) == 6
    refused = [line for line in found if "refused: ga.num_elites: must be at most" in line]
    assert 0 < len(refused) < 6, found

    # the page tells the trials, with the scores of a slow and obvious second opinion
    report = outputs / "reports" / folder.name
    table = pd.read_csv(report / "search.csv").query("axis == 'trial'").set_index("trial")
    (as_it_is,) = expand(EXPERIMENT, only=["via-point GA"])
    own = load(as_it_is.conditions[0].condition.id).summaries
    for line in sorted(set(found) - set(refused)):
        number, score, settings = re.match(r"trial (\d+): score (\S+), .* · (.*)$", line).groups()
        (experiment,) = expand([*EXPERIMENT, *shlex.split(settings)], only=["via-point GA"])
        mine = load(experiment.conditions[0].condition.id).summaries
        assert table["score"][int(number)] == pytest.approx(float(score), rel=1e-3)
        assert np.mean(judged(mine, own)) == pytest.approx(float(score), rel=1e-3)
    assert table["score"][0] == pytest.approx(np.mean(judged(own, own)))
    drawn = (report / "search.svg").read_bytes()
    again = evoexp("report", *WORDS, "sweep.num_trials=6")
    assert again.code == 0 and (report / "search.svg").read_bytes() == drawn


def test_each_combination_is_one_trial_and_what_changes_later_is_told(
    evoexp: Evoexp, outputs: Path
) -> None:
    words = ("experiment=rana_planar", "budget=smoke", "runner=serial", "ga.num_generations=40")
    words += ("ga.num_elites=0,60", "sweep=optuna", "sweep.num_trials=9", "--only", "via-point GA")
    assert "ga.num_elites: must be at most" in evoexp("run", *words).err
    words += ("ga.population_size=50,70",)  # 60 elites go with one of these
    said = evoexp("run", *words, *NO_REPORT)
    lines = re.findall(r"^trial [1-9].* · (.*)$", said.out, re.M)
    assert said.code == 0 and len(set(lines)) == len(lines) == 4, said
    assert said.out.count("refused: ga.num_elites: must be at most") == 1
    assert "trial 4 of 9 is the last: no other combination of values is left" in said.out
    assert evoexp("run", *words, *NO_REPORT).out.count("trial ") == 2

    def page() -> str:
        assert evoexp("report", *words).code == 0
        return next((outputs / "reports").glob("*/index.html")).read_text()

    remark = "Trials whose runs have changed since the search learned from their scores: "
    assert remark not in page()
    for log in (outputs / "runs").rglob("0000.mcap"):
        log.unlink()
    assert remark in " ".join(page().split())


def judged(runs: pd.DataFrame, own: pd.DataFrame) -> list[float]:
    proven = own[own["solved"] & (own["certified"] == True)]  # noqa: E712
    reference = (proven if len(proven) else own)["best_cost"].mean()
    return [
        min(run.best_cost / reference, 10.0) if run.solved and run.certified is True else 10.0
        for run in runs.itertuples()
    ]
