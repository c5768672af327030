"""The pages on Rana & Zalzala 1995: claims, checks, and the tables behind their figures."""

from pathlib import Path

import numpy as np
import pytest

from evoexp.papers.rana import claims as paper_claims
from evoexp.papers.rana import measures
from evoexp.papers.rana.figures import arm_motions
from evoexp.records import generations
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_parts import Page
from evoexp.report.results import run_measures, stored_results
from evoexp.report.results.stored_results import ConditionResults
from evoexp.shipped import Shipped
from report_samples import page_settings, smoke_results

WORDS = ("ga.population_size=12", "ga.num_generations=3")
TWO = (*WORDS, "num_replicates=2")


def page(outputs: Path, name: str, *words: str) -> Page:
    return page_of(smoke_results(outputs, name, *words), page_settings(name))


@pytest.fixture(scope="module")
def obstacles(outputs: Path) -> ConditionResults:
    return smoke_results(outputs, "rana_obstacles").conditions[0]


def of_best(condition: ConditionResults, values: np.ndarray) -> float:
    return float(values[list(condition.summaries.index).index(condition.best_replicate)])


def steps_of_arms(condition: ConditionResults) -> list[np.ndarray]:
    """Return the lengths of the steps of each arm in the best motion [deg]."""
    q = measures.best_motion(condition)
    parts = (q[a:b] for a, b in condition.prepared.problem.arm_slices)
    return [np.linalg.norm(np.diff(part, axis=1), axis=0) for part in parts]


def test_approaches_by_kind_make_the_recorded_clearance(obstacles: ConditionResults) -> None:
    found = measures.approaches(obstacles)
    assert set(found["kind"]) == {measures.BETWEEN_ARMS, measures.TO_OBSTACLES}
    runs = found.groupby("replicate")
    assert runs["clearance"].min().to_numpy() == pytest.approx(obstacles.column("clearance"))
    kept = obstacles.summaries["certified_margin"].tolist()
    assert runs["kept"].all().tolist() == kept


def test_distances_to_obstacles_are_drawn_for_every_replicate(obstacles: ConditionResults) -> None:
    table = arm_motions.distances_table(obstacles, 5)
    for kind, margin in ((measures.BETWEEN_ARMS, 1.0), (measures.TO_OBSTACLES, 0.5)):
        own = table[table["kind"] == kind]
        assert set(own["safety_distance"]) == {margin}
        exact = own[own["series"].isin([arm_motions.CLOSEST, arm_motions.REFUTED])]
        assert len(exact) == obstacles.done, "no replicate is dropped"
    # by hand: the least distance of circle centres to the ball at (5, 4.6) of radius 0.4
    problem = obstacles.prepared.problem
    centres = np.vstack(problem.sphere_centres(problem.start))
    ball = np.linalg.norm(centres - [5.0, 4.6, 0.0], axis=1).min() - 0.4
    assert problem.obstacle_distances(problem.start[:, None])[0] <= ball + 1e-9
    assert table["distance"].min() >= 0.0
    titles = [axes.get_title() for axes in arm_motions.draw_distances(table).axes]
    assert [title[0] for title in titles] == ["a", "c", "b", "d"]


def test_runs_without_a_free_individual_count_as_never(obstacles: ConditionResults) -> None:
    first, recorded = run_measures.first_feasible(obstacles), "first_feasible_generation"
    assert np.array_equal(np.isinf(first), np.isnan(obstacles.column(recorded)))


@pytest.mark.parametrize(
    ("says", "expected"),
    [
        ([1, 0, 0], True),
        ([0, 1, 1], True),
        ([-1, 0, 0], False),
        ([-1, 1, 0], None),
        ([0, 0, 0], None),
    ],
)
def test_a_part_improves_if_nothing_is_worse(says: list[int], expected: bool | None) -> None:
    assert paper_claims.improves(says) is expected


def test_unevenness_is_the_sum_over_arms(obstacles: ConditionResults) -> None:
    by_hand = sum(np.abs(steps - steps.mean()).sum() for steps in steps_of_arms(obstacles))
    assert of_best(obstacles, measures.unevenness(obstacles)) == pytest.approx(by_hand, rel=1e-9)


def test_pairs_kept_apart_are_counted_against_all_pairs(outputs: Path) -> None:
    (condition, *_) = smoke_results(outputs, "rana_crossover", *WORDS).conditions
    shares = measures.kept_apart(condition)
    assert list(shares) == [0]  # three generations only
    planner, problem = condition.planner, condition.prepared.problem
    first = next(iter(generations(planner.evolve(problem, condition.condition.rng(0)))))
    parts = [first.population[a:b, 1:-1, :12] for a, b in problem.arm_slices]
    near = [
        np.mean(np.linalg.norm(p[..., :, None] - p[..., None, :], axis=0) < 100.0, axis=0)
        for p in parts
    ]
    apart = (1.0 - near[0] * near[1])[~np.eye(12, dtype=bool)].mean()  # all pairs, sites, arms
    assert shares[0] == pytest.approx(apart, abs=0.05)  # 2000 pairs: four standard errors


def test_the_page_of_the_weights_tells_what_a_collision_costs(outputs: Path) -> None:
    found = page(outputs, "rana_collision_weight", *WORDS)
    assert [row[1] for row in found.tables[0].rows] == ["10°", "1°", "3°", "30°", "100°"]
    printed = smoke_results(outputs, "rana_collision_weight", *WORDS).conditions[0]
    problem = printed.prepared.problem
    way = problem.goal - problem.start
    straight = np.linalg.norm(way[:3]) + np.linalg.norm(way[3:])
    assert f"{100 * 10 / straight:.1f} %" in found.claims[1].evidence
    by_hand = sum(steps.sum() for steps in steps_of_arms(printed))
    assert of_best(printed, measures.length(printed)) == pytest.approx(by_hand, rel=1e-9)


def test_ablations_that_are_stored_judge_the_papers_page(
    outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "rana_planar_ablations"
    ablations = smoke_results(outputs, name, *TWO).conditions
    ids = [(c.label, c.condition.id) for c in ablations] + [("never run", "f" * 64)]
    rows = tuple(Shipped(name, label, "paper", each, "0" * 32) for label, each in ids)
    monkeypatch.setattr(stored_results, "shipped", lambda: rows)
    results = smoke_results(outputs, "rana_planar", *TWO)
    beside = {c.label: c.done for c in results.beside(name).conditions}
    assert beside == dict.fromkeys([c.label for c in ablations], 2)
    claims = page(outputs, "rana_planar", *TWO).claims
    told = [c.evidence for c in claims if "Relaxation and redistribution" in c.text]
    assert len([evidence for evidence in told if "refuted motions" in evidence]) == 3
    assert results.beside("rana_puma_ablations").conditions == ()


def test_what_evolution_adds_is_told_of_the_best_control_first(outputs: Path) -> None:
    claims = page(outputs, "rana_planar", *TWO).claims
    (claim,) = (claim for claim in claims if claim.text.startswith("Evolution adds"))
    controls = smoke_results(outputs, "rana_planar", *TWO).conditions[1:]
    best = min(controls, key=lambda c: float(np.median(c.column("best_cost"))))
    assert f"to the best control, {best.label}, evolution adds" in claim.evidence
    assert "straight line −527.3" in claim.evidence
