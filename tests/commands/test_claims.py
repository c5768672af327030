"""`evoexp claims`: every claim with rule, numbers, n and verdict, run or not."""

import json
from pathlib import Path

import pytest
from command_samples import Evoexp

from evoexp.commands.claim_list import KEYS
from evoexp.configuration.search_path import options
from evoexp.registry import CLAIMS, Registration, registrations
from evoexp.report.statistics.judging import registered_rules


def test_a_claim_that_nothing_was_run_for_names_the_command(evoexp: Evoexp) -> None:
    said = evoexp("claims", "lavoie")
    assert said.code == 0 and "{" not in said.out
    assert "evoexp run experiment=lavoie_controls" in said.out and "not run" in said.out


def test_a_claim_is_traced_to_rule_numbers_and_n(evoexp: Evoexp, outputs: Path) -> None:
    assert evoexp("run", "experiment=chen_fields", "--no-report").code == 0
    every = json.loads(evoexp("claims", "chen", "--json").out)
    rows = [row for row in every if row["experiment"] == "chen_fields"]
    assert rows
    for row in rows:
        assert list(row) == list(KEYS)
        assert row["rule"].startswith("reproduced if ")
        assert row["verdict"] in ("reproduced", "contradicted")
        assert row["command"] == "evoexp report chen_fields"
    assert any("nodes as printed" in row["evidence"] for row in rows)


def test_a_rule_is_listed_once_for_the_same_runs_by_who_was_run(evoexp: Evoexp) -> None:
    """`rana` has the conditions of `rana_planar`; where it was not run, these are not hidden."""
    for experiment, judging in (("rana_planar", "rana_planar"), ("rana", "rana")):
        said = evoexp("run", f"experiment={experiment}", "num_replicates=1", "--no-report")
        assert said.code == 0
        rows = json.loads(evoexp("claims", "rana", "--json").out)
        found = {r["experiment"] for r in rows if r["name"] == "margin_of_bodies"}
        ran = {r["experiment"] for r in rows if r["verdict"] != "not run"}
        assert judging in found & ran
    assert "rana_planar" not in found


@pytest.mark.parametrize("paper", registrations(CLAIMS), ids=lambda each: each.name)
def test_every_experiment_that_a_rule_names_is_there(paper: Registration) -> None:
    for rule in registered_rules(paper).values():
        assert rule.experiments, rule.name
        assert not set(rule.experiments) - set(options("experiment")), rule.name
