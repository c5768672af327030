from pathlib import Path

import numpy as np
import pytest

from evoexp.report.pages.page_builder import page_of
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.claim_rules import KINDS, Rules, read_rules
from evoexp.report.statistics.comparisons import compare
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge, left_out, not_judged
from report_samples import REPORT

SETTINGS = ReportSettings(**REPORT, figures=None)  # type: ignore[arg-type]
BETTER = compare("cost", np.arange(12.0), np.arange(12.0) + 20.0, True, 0.95)
ENTRY = (
    '{{claim: "{{who}}a claim of {{metric}}", source: "section 5", kind: {kind}, experiments: [e]'
)


def rules_of(tmp_path: Path, kind: str, more: str = "") -> Rules:
    path = tmp_path / f"{abs(hash((kind, more)))}.yaml"
    path.write_text("told: " + ENTRY.format(kind=kind) + more + "}", encoding="utf-8")
    return read_rules(path)


OWN = ', reproduced: "{metric} at most {most} times", limits: {most: 2.5}'


def test_a_rule_fills_in_its_words_and_limits(tmp_path: Path) -> None:
    rule = rules_of(tmp_path, "own", OWN)["told"].about(who="7-DOF: ", metric="cycles")
    assert rule.claim == "7-DOF: a claim of cycles"
    assert rule.text == "reproduced if cycles at most 2.5 times"
    assert rule.limits["most"] == 2.5
    with pytest.raises(KeyError, match="metric"):
        rules_of(tmp_path, "own", OWN)["told"].about(who="")
    unjudged = rules_of(tmp_path, "own", OWN)["told"].unjudged()
    assert unjudged.claim == "…a claim of …"
    assert unjudged.text == "reproduced if … at most 2.5 times"


@pytest.mark.parametrize(
    ("kind", "more", "named"),
    [
        ("evry", "", "evry"),
        ("every", ", limit: {most: 1}", "limit"),
        ("own", "", "says when"),
        ("every", OWN, "says when"),
        ("every", ', contradicted: "never"', "says when"),
    ],
)
def test_a_rule_that_is_wrong_is_refused(tmp_path: Path, kind: str, more: str, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        rules_of(tmp_path, kind, more)


@pytest.mark.parametrize("kind", KINDS)
def test_a_claim_carries_rule_and_number_and_is_judged_by_its_own_kind_alone(
    tmp_path: Path, kind: str
) -> None:
    rules = rules_of(tmp_path, kind, OWN if kind == "own" else "")
    hearing = Judge("", SETTINGS, rules).on("told", who="", metric="cycles")
    one, two = Proportion(20, 20), Proportion(0, 20)
    judged = {
        "every": lambda: hearing.every("20", 20, 20, 20),
        "majority": lambda: hearing.majority("20", 20, 20),
        "better": lambda: hearing.better(BETTER, "lower"),
        "better than all": lambda: hearing.better_than_all("20", [BETTER]),
        "best": lambda: hearing.best("20", [BETTER], True),
        "greater": lambda: hearing.greater("20", one, two),
        "same share": lambda: hearing.same_share("20", one, one, 1.0),
        "own": lambda: hearing.own("20", 20, True),
    }
    assert judged.keys() == KINDS.keys()
    claim = judged[kind]()
    assert (claim.verdict, claim.name) == ("reproduced", "told")
    assert claim.rule.startswith("reproduced if ")
    assert "{" not in claim.rule
    assert any(number in claim.n for number in ("20", "12"))
    for other in judged.keys() - {kind}:
        with pytest.raises(ValueError, match=f"its rule is '{kind}'"):
            judged[other]()


def test_an_unjudged_claim_names_the_reason_and_keeps_its_numbers(tmp_path: Path) -> None:
    hearing = Judge("budget smoke", SETTINGS, rules_of(tmp_path, "every")).on(
        "told", who="", metric="cycles"
    )
    claim = hearing.every("1 of 2", 1, 2, 2)
    assert (claim.verdict, claim.evidence) == ("not judged (budget smoke)", "1 of 2")
    assert hearing.elsewhere("its sweep").verdict == "not judged"


@pytest.mark.parametrize("kind", ["better", "better than all", "best"])
def test_a_comparison_with_nothing_is_not_judged(tmp_path: Path, kind: str) -> None:
    hearing = Judge("", SETTINGS, rules_of(tmp_path, kind)).on("told", who="", metric="cycles")
    claim = {
        "better": lambda: hearing.better(None, "lower"),
        "better than all": lambda: hearing.better_than_all("–", []),
        "best": lambda: hearing.best("–", [], True),
    }[kind]()
    assert claim.verdict == "not judged (nothing to compare)"


def test_claims_on_conditions_that_were_left_out_are_not_judged(results: Results) -> None:
    assert list(left_out(results, ())) == []
    alone = results._replace(conditions=results.conditions[:1])
    found = {claim.name: claim for claim in left_out(alone, ())}
    assert {"free_at_via_points", "evolution_adds"} <= found.keys()
    assert {claim.verdict for claim in found.values()} == {"not judged (conditions left out)"}
    assert all("multi-start, random search" in claim.evidence for claim in found.values())
    judged = [found.pop("free_at_via_points")]
    assert [claim.name for claim in left_out(alone, judged)] == list(found)


def test_nothing_is_judged_on_a_control_alone(results: Results) -> None:
    controls = tuple(c for c in results.conditions if c.is_control)
    alone = results._replace(conditions=controls, budget="paper")
    assert not_judged(alone) == "only a control was run"
    claims = page_of(alone, ReportSettings(**REPORT, figures="rana")).claims
    own = [claim.verdict for claim in claims if claim.name == "free_at_via_points"]
    assert own == ["not judged (only a control was run)"] * len(controls)
