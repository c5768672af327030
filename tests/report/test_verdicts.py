"""Rules of claims, and the verdicts that follow from them, on made-up and on simulated studies."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Comparison, compare
from evoexp.report.statistics.inference import Proportion, fisher_exact, runs_for_effect
from evoexp.report.statistics.judging import CONTRADICTED, REPRODUCED, UNDECIDED
from report_samples import hearing, page_settings

LOW = np.arange(12.0)


def pair(first: float, second: float) -> Comparison:
    """Return a comparison of lower-is-better values that differ by a constant."""
    return compare("cost", LOW + first, LOW + second, True, 0.95)


BETTER, WORSE, EQUAL = pair(0.0, 20.0), pair(20.0, 0.0), pair(0.0, 0.0)
EVERY, NONE, EMPTY = Proportion(20, 20), Proportion(0, 20), Proportion(0, 0)


def judge(on: judging.Hearing, kind: str, arguments: Any) -> Claim:
    return getattr(on, kind.replace(" ", "_"))(*arguments)


def judged(kind: str, *arguments: Any, significance: float = 0.05) -> str:
    return judge(hearing(kind, significance), kind, arguments).verdict


@pytest.mark.parametrize(
    ("kind", "arguments", "verdict"),
    [
        ("every", ("", 20, 20, 20), REPRODUCED),
        ("every", ("", 19, 20, 20), CONTRADICTED),
        ("every", ("", 3, 4, 20), CONTRADICTED),  # one counter-example is enough
        ("every", ("", 4, 4, 20), UNDECIDED),  # but only all runs reproduce
        ("every", ("", 0, 0, 20), UNDECIDED),
        ("every", ("", 0, 0, 0), UNDECIDED),
        ("better", (BETTER, "lower"), REPRODUCED),
        ("better", (WORSE, "lower"), CONTRADICTED),
        ("better", (EQUAL, "lower"), UNDECIDED),
        ("better", (None, "lower"), "not judged (nothing to compare)"),
        ("better than all", ("", [BETTER, BETTER]), REPRODUCED),
        ("better than all", ("", [BETTER, EQUAL]), UNDECIDED),
        ("better than all", ("", [BETTER, WORSE]), CONTRADICTED),
        ("better than all", ("", [EQUAL]), UNDECIDED),
        ("better than all", ("", []), "not judged (nothing to compare)"),
        ("best", ("", [BETTER, EQUAL], True), REPRODUCED),  # a neighbour may be as good
        ("best", ("", [BETTER, EQUAL], False), UNDECIDED),
        ("best", ("", [EQUAL, EQUAL], True), UNDECIDED),  # then none matters
        ("best", ("", [BETTER, WORSE], True), CONTRADICTED),
        ("best", ("", [], True), "not judged (nothing to compare)"),
        ("greater", ("", Proportion(999, 1000), Proportion(964, 1000)), REPRODUCED),
        ("greater", ("", Proportion(964, 1000), Proportion(999, 1000)), CONTRADICTED),
        ("greater", ("", Proportion(999, 1000), Proportion(964, 1000), 0.06), UNDECIDED),
        ("greater", ("", Proportion(1000, 1000), Proportion(998, 1000)), UNDECIDED),
        ("greater", ("", EMPTY, Proportion(1, 1)), UNDECIDED),
        ("greater", ("", Proportion(5, 10), Proportion(5, 10), 0.01), UNDECIDED),  # p of a family
        ("own", ("", 20, np.True_), REPRODUCED),
        ("own", ("", 20, np.False_), CONTRADICTED),
        ("own", ("", 20, None), UNDECIDED),
    ],
)
def test_a_claim_is_judged_by_its_kind(kind: str, arguments: Any, verdict: str) -> None:
    assert judged(kind, *arguments) == verdict


def test_a_comparison_knows_which_way_is_better() -> None:
    lower, higher = (compare("x", LOW, LOW + 20.0, way, 0.95) for way in (True, False))
    assert (lower.better.a12, higher.better.a12) == (1.0, 0.0)
    assert lower.median_difference == higher.median_difference == -20.0
    assert (lower.better.direction, higher.better.direction) == (1, -1)
    assert lower.better.p_value == higher.better.p_value
    assert lower.num_runs == "12"
    assert [c.says(0.05) for c in (BETTER, WORSE, EQUAL)] == [1, -1, 0]
    assert judged("better", BETTER, "lower", significance=1e-9) == UNDECIDED


def test_two_infinite_costs_do_not_differ() -> None:
    first, second = np.array([1.0, np.inf, np.inf]), np.array([2.0, np.inf, 3.0, np.inf])
    found = compare("cost", first, second[:3], True, 0.95)
    assert (found.median_difference, found.num_runs) == (np.inf, "3")
    found = compare("cost", first, second[[0, 1, 1, 1]], True, 0.95)
    assert (found.median_difference, found.num_runs) == (0.0, "3 and 4")


def test_unsolved_runs_are_the_worst_class_whatever_the_rest_cost() -> None:
    """Of runs that never get there it counts how many there are, not by how much others differ."""
    order, never = np.arange(20.0) / 100.0, np.arange(20) >= 4
    second = np.where(never, np.inf, 1.0) + order
    comparison = compare("cost", np.where(never, 2.0, np.inf) + order, second, True, 0.95)
    assert judged("better", comparison, "lower") == REPRODUCED
    words = judging.evidence(comparison, "lower")
    assert words.startswith("lower in 72 % of all pairs of runs (A12 0.720 [")


values = st.one_of(st.integers(-3, 3).map(float), st.floats(-9.0, 9.0), st.just(np.inf))


@given(st.lists(st.tuples(values, values), min_size=1, max_size=40), st.booleans())
@settings(max_examples=200)
def test_no_verdict_goes_against_its_statistic(
    pairs: list[tuple[float, float]], lower_is_better: bool
) -> None:
    first, second = np.array(pairs).T
    one = compare("x", first, second, lower_is_better, 0.95)
    says = one.says(0.05)
    assert says == -compare("x", second, first, lower_is_better, 0.95).says(0.05)
    assert says in (0, one.better.direction)
    assert (says != 0) == (one.better.p_value < 0.05)
    best, worst = (first, second) if lower_is_better else (second, first)
    verdict = judged("better", one, "lower")
    assert verdict != CONTRADICTED or not (best <= worst).all()
    assert verdict != REPRODUCED or not (best >= worst).all()


@given(st.integers(0, 30), st.integers(0, 30), st.integers(0, 30), st.integers(0, 30))
def test_shares_are_told_apart_in_their_own_direction(a: int, b: int, c: int, d: int) -> None:
    one, two = Proportion(min(a, b), b), Proportion(min(c, d), d)
    p_value = fisher_exact(one, two)
    says = judging.greater(one, two, p_value, 0.05)
    assert says == -judging.greater(two, one, p_value, 0.05)
    if one.total and two.total:
        assert says in (0, int(np.sign(one.share - two.share)))
        assert (says != 0) == (p_value < 0.05)


def test_an_undecided_claim_says_how_many_runs_would_decide() -> None:
    """As many as are needed for a power of 0.8, tried on simulated studies of that size."""
    rng, shift = np.random.default_rng(1), 0.4
    first, second = np.sort(rng.normal(0.0, size=12)), np.sort(rng.normal(shift, size=12))
    claim = hearing("better").better(compare("x", first, second, True, 0.95), "lower")
    assert claim.verdict == UNDECIDED
    assert re.search(r"; about \d+0 runs of each would decide$", claim.evidence)
    truth = float(scipy.stats.norm.cdf(shift / math.sqrt(2.0)))
    needed = math.ceil(runs_for_effect(truth, 0.05))
    draws = rng.normal([[0.0], [shift]], size=(400, 2, needed))
    said = [compare("x", *draw, True, 0.95).says(0.05) == 1 for draw in draws]
    assert 0.74 < np.mean(said) < 0.86
    never = hearing("better").better(EQUAL, "lower").evidence
    assert never.endswith("; more than 10,000 runs of each would be needed to decide")
    assert "would" not in hearing("better").better(BETTER, "lower").evidence
    some, few = Proportion(16, 20), Proportion(12, 20)
    shares = hearing("greater").greater("", some, few)
    assert shares.evidence == "about 90 runs of each would decide"
    assert hearing("greater").greater("", EMPTY, few).evidence == ""


ENTRY = 'told: {{claim: "{{who}}a claim of {{metric}}", source: "section 5", kind: {kind}, '
OWN = ', reproduced: "{metric} at most {most} times", limits: {most: 2.5}'


def rules_of(tmp_path: Path, kind: str, more: str = "") -> judging.Rules:
    path = tmp_path / "rules.yaml"
    path.write_text(ENTRY.format(kind=kind) + "experiments: [e]" + more + "}", encoding="utf-8")
    return judging.read_rules(path)


def test_a_rule_fills_in_its_words_and_limits(tmp_path: Path) -> None:
    told = rules_of(tmp_path, "own", OWN)["told"]
    rule = told.about({"who": "7-DOF: ", "metric": "cycles"})
    unjudged = told.about()
    assert (rule.claim, unjudged.claim) == ("7-DOF: a claim of cycles", "…a claim of …")
    assert rule.text == "reproduced if cycles at most 2.5 times"
    assert unjudged.text == "reproduced if … at most 2.5 times"
    assert rule.limits["most"] == 2.5
    with pytest.raises(KeyError, match="metric"):
        told.about({"who": ""})


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


REPRODUCING = {
    "every": ("20", 20, 20, 20),
    "majority": ("20", 20, 20),
    "above": (Proportion(20, 20), 0.95),
    "at least": (20.0,),
    "better": (BETTER, "lower"),
    "better than all": ("20", [BETTER]),
    "best": ("20", [BETTER], True),
    "greater": ("20", EVERY, NONE),
    "same share": ("20", EVERY, EVERY, 1.0),
    "own": ("20", 20, True),
}


@pytest.mark.parametrize("kind", judging.KINDS)
def test_a_claim_carries_its_rule_and_is_judged_by_its_kind_alone(
    tmp_path: Path, kind: str
) -> None:
    limits = ", limits: {percent: 50.0, number: 10.0}" if kind in ("above", "at least") else ""
    rules = rules_of(tmp_path, kind, OWN if kind == "own" else limits)
    on = judging.Judge("", page_settings("", "rana"), rules).on("told", who="", metric="cycles")
    claim = judge(on, kind, REPRODUCING[kind])
    # 20 runs that agree are no proof that two shares are the same
    verdict, rule = ("undecided", "practically") if kind == "same share" else ("reproduced",) * 2
    assert (claim.verdict, claim.name) == (verdict, "told")
    assert claim.rule.startswith(rule) and "{" not in claim.rule
    assert any(number in claim.n for number in ("20", "12", "–"))
    for other in judging.KINDS.keys() - {kind}:
        with pytest.raises(ValueError, match=f"its rule is '{kind}'"):
            judge(on, other, REPRODUCING[other])


def test_differences_that_do_not_matter_are_practically_equal(tmp_path: Path) -> None:
    """However significant they are: every A12 in 0.4 to 0.6, every share within 3 points."""
    rng = np.random.default_rng(0)
    one, two = rng.random(5000), rng.random(5000) + 0.03
    row = compare("cost", one, two, True, 0.95)
    assert row.says(0.05) == 1

    def on(kind: str) -> judging.Hearing:
        (tmp_path / kind).mkdir(exist_ok=True)
        rules = rules_of(tmp_path / kind, kind)
        return judging.Judge("", page_settings("", "rana"), rules).on("told", who="", metric="")

    claim = on("better").better(row, "lower")
    assert claim.verdict == "practically equal"
    assert claim.size is not None
    assert 0.4 < claim.size.low < claim.size.value < claim.size.high < 0.6
    few, many = Proportion(19, 20), Proportion(950, 1000)
    for own, p_value, verdict in (
        (many, 1.0, "practically equal"),
        (few, 1.0, "undecided"),
        (Proportion(800, 1000), 1e-9, "contradicted"),
    ):
        assert on("same share").same_share("", own, many, p_value).verdict == verdict


def test_an_unjudged_claim_names_the_reason_and_keeps_its_numbers(tmp_path: Path) -> None:
    own = judging.Judge("budget smoke", page_settings("", "rana"), rules_of(tmp_path, "every"))
    on = own.on("told", who="", metric="cycles")
    claim = on.every("1 of 2", 1, 2, 2)
    assert (claim.verdict, claim.evidence) == ("not judged (budget smoke)", "1 of 2")
    assert on.elsewhere("its sweep").verdict == "not judged"


def test_claims_on_conditions_that_were_left_out_are_not_judged(results: Results) -> None:
    assert list(judging.left_out(results, ())) == []
    alone = results._replace(conditions=results.conditions[:1])
    found = {claim.name: claim for claim in judging.left_out(alone, ())}
    assert {"free_at_via_points", "evolution_adds"} <= found.keys()
    assert {claim.verdict for claim in found.values()} == {"not judged (conditions left out)"}
    assert all("multi-start, random search" in claim.evidence for claim in found.values())
    judged = [found.pop("free_at_via_points")]
    assert [claim.name for claim in judging.left_out(alone, judged)] == list(found)


def test_nothing_is_judged_on_a_control_alone(results: Results) -> None:
    controls = tuple(c for c in results.conditions if c.is_control)
    alone = results._replace(conditions=controls, budget="paper")
    assert judging.not_judged(alone) == "only a control was run"
    claims = page_of(alone, page_settings("", "rana")).claims
    own = [claim.verdict for claim in claims if claim.name == "free_at_via_points"]
    assert own == ["not judged (only a control was run)"] * len(controls)
