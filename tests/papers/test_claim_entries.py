"""Claims that a page's file judges itself: by the kind of their rule, on conditions that exist."""

from collections import defaultdict
from typing import Any

import numpy as np
import pytest

from evoexp.registry import CLAIMS, names, registered
from evoexp.report.pages.judged_entries import judged_as_written
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_scope import Functions, Scope
from evoexp.report.statistics.claim_rules import Rule, registered_rules
from evoexp.report.statistics.judging import Judge
from evoexp.shipped import shipped
from report_samples import made_up, page_settings, smoke_experiment

NUMBERS = {"percent": 50.0, "number": 10.0}
FUNCTIONS = Functions(
    {
        "cost": lambda condition: condition.column("best_cost"),
        "low": lambda condition: condition.column("best_cost") < 1.0,
        "many": lambda condition: float(condition.done),
    }
)


def judged(kind: str, **entry: Any) -> list[tuple[str, str]]:
    """Judge an entry on made-up runs: "7-DOF" costs 0 to 1, every other condition 2 to 3."""
    results = made_up(
        smoke_experiment("lavoie_coding"),
        lambda label: {"best_cost": np.linspace(0.0, 0.9, 40) + 2.0 * (label != CHEAP)},
    )
    rule = Rule("told", "{who} beside {others}", "", kind, "it holds", "", NUMBERS, ())
    judge = Judge("", page_settings("lavoie_coding"), {"told": rule})
    values = {"judge": judge, "settings": judge.settings, "conditions": results.conditions}
    scopes = [Scope(FUNCTIONS, values)]
    return [(c.text, c.verdict) for c in judged_as_written(scopes, {"claim": "told", **entry})]


CHEAP, DEAR = (label for label, _ in smoke_experiment("lavoie_coding").conditions[:2])


@pytest.mark.parametrize(
    ("kind", "values", "than"),
    [
        ("better", "cost", DEAR),
        ("better than all", "cost", [DEAR]),
        ("greater", "low", DEAR),
        ("every", "low", []),
        ("majority", "low", []),
        ("above", "low", []),
        ("at least", "many", []),
    ],
)
def test_an_entry_is_judged_by_the_kind_of_its_rule(kind: str, values: str, than: Any) -> None:
    others = than if isinstance(than, str) else ", ".join(than)
    ((text, verdict),) = judged(kind, of=CHEAP, than=than, values=values)
    assert (text, verdict) == (f"{CHEAP} beside {others}", "reproduced")
    if than:
        ((_, other),) = judged(kind, of=DEAR, than=CHEAP, values=values)
        assert other == "contradicted"
    assert judged(kind, of="left out", than=than, values=values) == []


def test_entries_of_papers_name_conditions_that_their_experiments_have() -> None:
    labels = defaultdict[str, set[str]](set)
    for row in shipped():
        labels[row.experiment].add(row.label)
    wrong = []
    for paper in names(CLAIMS):
        registration = registered(CLAIMS, paper)
        assert registration is not None
        rules = registered_rules(registration)
        pages = read_page_file(registration.target.partition(":")[0]).entries["pages"]
        written = [e for page in pages.values() for e in page.get("claims", ())]
        written += [e for own in written if isinstance(own, dict) for e in own.get("judge", ())]
        entries = [e for e in written if isinstance(e, dict) and "claim" in e]
        for entry in entries:
            than = entry.get("than", [])
            named = {entry.get("of", "{"), *([than] if isinstance(than, str) else than)}
            known = [labels[experiment] for experiment in rules[entry["claim"]].experiments]
            fixed = {label for label in named if "{" not in label}
            if not any(fixed <= own for own in known):
                wrong.append((paper, entry["claim"], fixed))
    assert wrong == []
