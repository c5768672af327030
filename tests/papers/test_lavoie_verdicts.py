"""The rules by which claims of Lavoie & Boudreau 2001 are judged.

On made-up runs of the shipped conditions.
"""

import dataclasses
import functools

import numpy as np
import pandas as pd
import pytest

import report_samples
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.inference import Proportion, fisher_exact
from evoexp.report.statistics.judging import (
    CONTRADICTED,
    NOT_JUDGED,
    REPRODUCED,
    UNDECIDED,
    Judge,
    judge,
)
from report_samples import REPORT, hearing

RULES = read_page_file("evoexp.papers.lavoie").rules
SETTINGS = ReportSettings(**REPORT, figures="lavoie")  # type: ignore[arg-type]


@functools.cache
def conditions_of(*words: str) -> Experiment:
    return compose.expand([f"experiment={words[0]}", *words[1:]])[0]


def made_up(errors: dict[str, np.ndarray], *words: str) -> Results:
    """Return results in which the runs of every condition, by label, have these errors.

    NaN: no solution.
    """

    def columns(label: str) -> dict[str, object]:
        values = errors[label]
        solved = ~np.isnan(values)
        return {
            "solved": solved,
            "certified": pd.array([True] * len(values), dtype="boolean"),
            "evaluations": np.full(len(values), 1000),
            "term_position_error_sp2": np.where(solved, values, 0.5),
            "term_attempts": np.ones(len(values)),
        }

    return report_samples.made_up(conditions_of(*words), columns)


def below_one(count: int, runs: int = 1000) -> np.ndarray:
    return np.where(np.arange(runs) < count, 0.5, 1.5)


@pytest.mark.parametrize(
    ("count", "runs", "verdict"),
    [
        (935, 1000, REPRODUCED),
        (950, 1000, REPRODUCED),  # within two samples' spread
        (964, 1000, CONTRADICTED),
        (900, 1000, CONTRADICTED),
        (96, 100, REPRODUCED),  # few runs say little
    ],
)
def test_a_printed_percentage_is_a_sample_too(count: int, runs: int, verdict: str) -> None:
    results = made_up({"7-DOF": below_one(count, runs), "10-DOF": below_one(991)}, "lavoie")
    found = claims.percentages(Judge("", SETTINGS, RULES), results.conditions)
    assert [claim.verdict for claim in found] == [verdict, *[REPRODUCED] * 3]


def test_four_percentages_are_one_family_of_tests() -> None:
    """Alone, 99.9 % would contradict the printed 99.1 %; among four tests it does not."""
    both = {"7-DOF": below_one(935), "10-DOF": below_one(999)}
    one, two = Proportion(999, 1000), Proportion(991, 1000)
    assert fisher_exact(one, two) < 0.05 < 4 * fisher_exact(one, two)
    found = claims.percentages(Judge("", SETTINGS, RULES), made_up(both, "lavoie").conditions)
    assert [claim.verdict for claim in found] == [REPRODUCED] * 4
    assert all("adjusted by Holm over 4" in claim.evidence for claim in found)


@pytest.mark.parametrize(
    ("one", "two", "verdict"),
    [
        (Proportion(999, 1000), Proportion(964, 1000), REPRODUCED),
        (Proportion(964, 1000), Proportion(999, 1000), CONTRADICTED),
        (Proportion(1000, 1000), Proportion(998, 1000), UNDECIDED),
        (Proportion(0, 0), Proportion(1, 1), UNDECIDED),
    ],
)
def test_one_proportion_is_greater(one: Proportion, two: Proportion, verdict: str) -> None:
    judged = hearing("greater").greater("", one, two)
    assert judged.verdict == verdict
    assert hearing("greater").greater("", one, two, 0.06).verdict == UNDECIDED


def test_printed_percentages_say_the_numbers_and_the_rule() -> None:
    results = made_up({"7-DOF": below_one(964), "10-DOF": below_one(991)}, "lavoie")
    seven, _, ten, _ = claims.percentages(Judge("", SETTINGS, RULES), results.conditions)
    assert (seven.verdict, ten.verdict) == (CONTRADICTED, REPRODUCED)
    assert seven.text == "7-DOF: a position error below 1 in 93.5 % of runs"
    assert "964 of 1000 = 96.4 % [95.1, 97.4]; the printed share lies outside" in seven.evidence
    assert (
        "its own thousand runs give [91.8, 94.9]; ours − printed +2.9 [+0.4, +5.4] points "
        "(Newcombe's 98.75 % interval), 95 % over the 4 together; Fisher's exact p, adjusted by "
        "Holm over 4, 0.01" in seven.evidence
    )
    assert "lies within, its own thousand runs give" in ten.evidence


def test_a_run_without_a_solution_has_no_error_below_anything() -> None:
    errors = below_one(1000)
    errors[:3] = np.nan
    results = made_up({"7-DOF": errors, "10-DOF": below_one(1000)}, "lavoie")
    seven = results.conditions[0]
    assert measures.below(seven, 2.0) == Proportion(997, 1000)
    assert np.isinf(measures.effort(seven)[:3]).all()


@pytest.mark.parametrize(
    ("label", "failures", "verdict"),
    [
        ("7-DOF", 0, REPRODUCED),
        ("7-DOF", 2, REPRODUCED),  # the paper prints as many
        ("7-DOF", 5, REPRODUCED),
        ("7-DOF", 11, UNDECIDED),
        ("7-DOF", 30, CONTRADICTED),
        ("10-DOF", 1, REPRODUCED),  # one run without a solution contradicts nothing
        ("10-DOF", 6, UNDECIDED),
        ("10-DOF", 25, CONTRADICTED),
    ],
)
def test_runs_need_no_start_if_they_fail_no_more_often_than_the_papers(
    label: str, failures: int, verdict: str
) -> None:
    errors = {name: below_one(1000) for name in ("7-DOF", "10-DOF")}
    errors[label][:failures] = np.nan
    results = made_up(errors, "lavoie")
    own = next(c for c in results.conditions if c.label == label)
    found = claims.no_start_needed(judge(results, SETTINGS, RULES), own)
    assert found is not None
    assert found.verdict == verdict
    assert f"{1000 - failures} of 1000" in found.evidence
    assert "lies above −1 point; contradicted if it lies below −1 point" in found.rule


def test_the_longer_arm_is_compared_with_the_shorter_one() -> None:
    results = made_up({"7-DOF": below_one(964), "10-DOF": below_one(999)}, "lavoie")
    below_1, below_2 = claims.more_joints_are_better(
        judge(results, SETTINGS, RULES), results.conditions
    )
    assert (below_1.verdict, below_2.verdict) == (REPRODUCED, UNDECIDED)
    assert "Fisher's exact p = 4.1e−10" in below_1.evidence
    alone = results._replace(conditions=results.conditions[:1])
    assert (
        list(claims.more_joints_are_better(judge(alone, SETTINGS, RULES), alone.conditions)) == []
    )


def test_motions_in_contact_contradict() -> None:
    results = made_up({"7-DOF": below_one(1000), "10-DOF": below_one(1000)}, "lavoie")
    seven, ten = results.conditions
    certified = seven.summaries["certified"].copy()
    certified[:115] = False
    seven = dataclasses.replace(seven, summaries=seven.summaries.assign(certified=certified))
    found = claims.free_of_collision(judge(results, SETTINGS, RULES), seven)
    assert found.verdict == CONTRADICTED
    assert "885 of 1000 certified; refuted 115 of 1000 = 11.5 % [9.7, 13.6]" in found.evidence
    free = claims.free_of_collision(judge(results, SETTINGS, RULES), ten)
    assert free.verdict == REPRODUCED


def test_what_is_overridden_or_too_few_is_not_judged() -> None:
    errors = {"7-DOF": below_one(935), "10-DOF": below_one(991)}
    few = made_up({label: values[:50] for label, values in errors.items()}, "lavoie")
    other = made_up(errors, "lavoie", "planner.success=finite")
    for results, why in ((few, "fewer replicates than planned"), (other, "settings overridden")):
        for claim in (
            *claims.percentages(judge(results, SETTINGS, RULES), results.conditions[:1]),
            *claims.more_joints_are_better(judge(results, SETTINGS, RULES), results.conditions),
            claims.no_start_needed(judge(results, SETTINGS, RULES), results.conditions[0]),
        ):
            assert claim is not None
            assert claim.verdict == f"{NOT_JUDGED} ({why})"


def sweep(results: Results, in_contact: dict[str, int] | None = None) -> list[Claim]:
    """Return the claims of a sweep; some accepted runs of each condition, by label, in contact."""
    counts = in_contact or {}
    refuted = {
        c.label: RefutedMotions(
            Proportion(counts.get(c.label, 0), c.solved), *[Proportion(0, c.solved)] * 2
        )
        for c in results.conditions
    }
    own = judge(results, SETTINGS, RULES)
    return [
        *claims.either_success(own, results),
        *claims.precision(own, results),
        *claims.generations(own, results),
        *claims.coding(own, results),
        *claims.blindness(own, results, lambda c: refuted[c.label]),
        *claims.judge_controls(own, results),
        *claims.positions(own, results, lambda c: refuted[c.label]),
    ]


def test_smaller_stopping_values_are_judged_step_by_step() -> None:
    labels = {
        (stop, most): f"stop below {stop}, at most {most}"
        for stop in ("2.0", "1.5", "1.0")
        for most in (100, 300)
    }
    spread = np.linspace(0.0, 0.1, 100)
    errors = {label: float(stop) / 4.0 + spread for (stop, _), label in labels.items()}
    errors[labels["1.0", 300]] = errors[labels["1.5", 300]]  # the last step brings nothing
    few = errors[labels["1.0", 100]].copy()
    few[:45] = np.nan  # runs without a solution, the worst class
    errors[labels["1.0", 100]] = few
    first, second, more = sweep(made_up(errors, "lavoie_stopping"))
    assert (first.verdict, second.verdict, more.verdict) == (UNDECIDED, UNDECIDED, REPRODUCED)
    assert "at most 100 generations" in first.text
    assert "median errors: 0.55 below 2, 0.425 below 1.5, 0.3455 below 1" in first.evidence
    assert "55 of 100" in more.evidence
    errors[labels["1.0", 100]] = 0.25 + spread
    assert sweep(made_up(errors, "lavoie_stopping"))[0].verdict == REPRODUCED


def test_codings_are_compared_arm_by_arm() -> None:
    values = np.linspace(0.1, 0.5, 200)
    errors = {
        "real": values,
        "binary": values + 0.2,
        "10-DOF, real": values + 0.2,
        "10-DOF, binary": values,
    }
    found = {claim.text: claim.verdict for claim in sweep(made_up(errors, "lavoie_coding"))}
    start = "Real coding performs better than binary coding, judged by"
    assert found == {
        f"{start} position error: real against binary": REPRODUCED,
        f"{start} evaluations to a solution: real against binary": UNDECIDED,
        f"{start} position error: 10-DOF, real against 10-DOF, binary": CONTRADICTED,
        f"{start} evaluations to a solution: 10-DOF, real against 10-DOF, binary": UNDECIDED,
    }


def test_the_algorithm_is_compared_with_the_best_of_its_controls() -> None:
    labels = [label for label, _ in conditions_of("lavoie_controls").conditions]
    errors = {label: np.full(200, np.nan if "random" in label else 0.3) for label in labels}
    errors["7-DOF, sub-paths drawn"][:40] = np.nan
    results = made_up(errors, "lavoie_controls")
    effort = {"7-DOF": 1000, "7-DOF, sub-paths drawn": 4000, "10-DOF": 1000}
    conditions = [
        dataclasses.replace(c, summaries=c.summaries.assign(evaluations=effort.get(c.label, 1000)))
        for c in results.conditions
    ]
    results = results._replace(conditions=tuple(conditions))
    claims_found = sweep(results, {"7-DOF, blind": 186, "10-DOF, blind": 3, "7-DOF": 20})
    assert [(claim.name, claim.text.split(": ")[0], claim.verdict) for claim in claims_found] == [
        ("blind_collides", "An arm that ignores obstacles collides", REPRODUCED),
        ("blind_collides", "An arm that ignores obstacles collides", UNDECIDED),
        ("more_solutions", "7-DOF", REPRODUCED),
        ("less_effort", "7-DOF", REPRODUCED),
        ("more_solutions", "10-DOF", UNDECIDED),  # its control solves every run, too
        ("less_effort", "10-DOF", UNDECIDED),
    ]
    more, less = claims_found[2:4]
    assert more.text.endswith("than its best control, 7-DOF, sub-paths drawn")
    assert "200 of 200 = 100.0 % [98.1, 100.0] against 160 of 200 = 80.0 %" in more.evidence
    assert "evolution adds 20 [15, 26] points" in more.evidence
    assert "median effort the control has solved 0 of 200" in more.evidence
    # all effort over all solutions: 1000 against 200 × 4000 / 160
    assert "expected running time 1000 against 5000 evaluations" in less.evidence
    assert "ratio 0.2 [" in less.evidence


def test_the_best_control_solves_most_and_then_costs_least() -> None:
    labels = [label for label, _ in conditions_of("lavoie_controls").conditions]
    none = made_up({label: np.full(20, np.nan) for label in labels}, "lavoie_controls")
    drawn, pairs = (c for c in none.conditions if c.is_control and c.label.startswith("7-DOF"))
    assert claims.best_control([pairs, drawn]) is pairs, "the first where none is better"
    one = dataclasses.replace(drawn, summaries=drawn.summaries.assign(solved=[True] + [False] * 19))
    assert claims.best_control([pairs, one]) is one
    cheap = dataclasses.replace(one, summaries=one.summaries.assign(evaluations=10))
    assert claims.best_control([one, cheap]) is cheap
    assert claims.solved_within(one, one).having == 1, "runs without a solution count not"


def test_positions_and_chords_are_judged_with_adjusted_p_values() -> None:
    labels = [label for label, _ in conditions_of("lavoie_sweeps_positions").conditions]
    results = made_up({label: np.full(200, 0.3) for label in labels}, "lavoie_sweeps_positions")
    contacts = {"7-DOF, M = 10, none": 72, "7-DOF, M = 10, chords": 20, "7-DOF, M = 50, chords": 9}
    found = {claim.text: claim for claim in sweep(results, contacts)}
    fewer = "Fewer accepted motions touch an obstacle"
    assert (
        found[f"{fewer}: 7-DOF, M = 10, chords against 7-DOF, M = 10, none"].verdict == REPRODUCED
    )
    middle = found[f"{fewer}: 7-DOF, M = 50, chords against 7-DOF, M = 10, chords"]
    assert middle.verdict == UNDECIDED  # 0.053 alone
    assert (
        found[f"{fewer}: 7-DOF, M = 100, chords against 7-DOF, M = 10, chords"].verdict
        == REPRODUCED
    )
    assert (
        found["M = 50 removes contacts altogether: 7-DOF, M = 50, chords"].verdict == CONTRADICTED
    )
    assert found["M = 50 removes contacts altogether: 10-DOF, M = 50, chords"].verdict == REPRODUCED
    assert len(found) == 10


def test_printed_percentages_are_judged_by_either_reading_of_a_success() -> None:
    errors = {
        "7-DOF, below its value": below_one(964),
        "7-DOF, any finite cost": below_one(953),
        "10-DOF, below its value": below_one(999),
        "10-DOF, any finite cost": below_one(982),
    }
    found = sweep(made_up(errors, "lavoie_success"))
    below_1 = {
        claim.text.split(":")[0]: claim.verdict for claim in found if "below 1 " in claim.text
    }
    expected = dict.fromkeys(errors, REPRODUCED) | {"7-DOF, below its value": CONTRADICTED}
    assert below_1 == expected
    assert len(found) == 8


def test_operators_judge_nothing() -> None:
    labels = [label for label, _ in conditions_of("lavoie_operators").conditions]
    assert (
        sweep(made_up({label: below_one(195, 200) for label in labels}, "lavoie_operators")) == []
    )
