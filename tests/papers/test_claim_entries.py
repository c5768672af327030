"""Claims that a page's file judges itself: by the kind of their rule, on conditions that exist."""

from collections import defaultdict
from typing import Any

import numpy as np
import pytest

from evoexp.registry import CLAIMS, names, registered
from evoexp.report.pages.judged_claims import judged_as_written
from evoexp.report.pages.page_file import Functions, Scope, read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.statistics.judging import Judge, Rule, registered_rules
from evoexp.shipped import shipped
from report_samples import made_up, page_settings, smoke_experiment

NUMBERS = {"percent": 50.0, "number": 10.0}
FUNCTIONS = Functions(
    {
        "cost": lambda condition: condition.column("best_cost"),
        "low": lambda condition: condition.column("best_cost") < 1.0,
        "all_low": lambda condition: bool((condition.column("best_cost") < 1.0).all()),
        "many": lambda condition: float(condition.done),
    }
)


def claims(kind: str, **entry: Any) -> list[Claim]:
    """Judge an entry on made-up runs: "7-DOF" costs 0 to 1, every other condition 2 to 3."""
    results = made_up(
        smoke_experiment("lavoie_coding"),
        lambda label: {"best_cost": np.linspace(0.0, 0.9, 40) + 2.0 * (label != CHEAP)},
    )
    rule = Rule("told", "{who} beside {others}", "", kind, "it holds", "", NUMBERS, ("far",))
    judge = Judge("", page_settings("lavoie_coding"), {"told": rule})
    values = {"judge": judge, "settings": judge.settings, "conditions": results.conditions}
    items = entry.pop("items", [""])
    scopes = [Scope(FUNCTIONS, {**values, "item": item}) for item in items]
    return list(judged_as_written(scopes, {"claim": "told", **entry}))


def judged(kind: str, **entry: Any) -> list[tuple[str, str]]:
    return [(claim.text, claim.verdict) for claim in claims(kind, **entry)]


CHEAP, DEAR = (label for label, _ in smoke_experiment("lavoie_coding").conditions[:2])


@pytest.mark.parametrize(
    ("kind", "values", "than"),
    [
        ("better", "cost", DEAR),
        ("better than all", "cost", [DEAR]),
        ("best", "cost", [DEAR]),
        ("greater", "low", DEAR),
        ("every", "low", []),
        ("majority", "low", []),
        ("above", "low", []),
        ("at least", "many", []),
        ("own", "all_low", []),
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


@pytest.mark.parametrize(
    ("entry", "evidence"),
    [
        ({"values": "low"}, "40 of 40 = 100 % [91, 100]"),
        ({"values": "low", "evidence": "{share}: {cost!d}"}, "40 of 40: 0.45"),
        ({"elsewhere": True}, "judged by `evoexp run experiment=far`"),
        ({"unjudged": "no time", "evidence": "{own[cost].max!n}"}, "0.9"),
    ],
)
def test_evidence_is_the_sentence_of_the_entry(entry: dict[str, Any], evidence: str) -> None:
    (claim,) = claims("majority", of=CHEAP, **entry)
    assert claim.evidence == evidence
    assert claim.verdict.startswith("not judged") == ("values" not in entry)


@pytest.mark.parametrize(("kind", "values"), [("better", "cost"), ("greater", "low")])
def test_tests_of_a_family_are_adjusted_together(kind: str, values: str) -> None:
    entry = {"of": CHEAP, "than": "{item}", "values": values, "items": [DEAR, DEAR]}
    alone, together = (claims(kind, family=family, **entry) for family in (False, True))
    assert [claim.verdict for claim in together] == ["reproduced"] * 2
    assert (alone[0].evidence != together[0].evidence) == (kind == "better")


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
