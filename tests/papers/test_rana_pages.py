"""The pages on Rana & Zalzala 1995: claims, checks, and the tables behind their figures."""

from pathlib import Path

import numpy as np
import pytest

from evoexp.papers.rana import claims as paper_claims
from evoexp.papers.rana import measures, motions
from evoexp.papers.rana.figures import planar_motion
from evoexp.records import generations
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import run_measures
from evoexp.report.results import stored_results as report_results
from evoexp.report.results.stored_results import Results
from evoexp.shipped import Shipped
from report_samples import page_settings, smoke_results

WORDS = ("ga.population_size=12", "ga.num_generations=3")


@pytest.fixture(scope="module")
def obstacles(outputs: Path) -> Results:
    return smoke_results(outputs, "rana_obstacles")


def test_approaches_by_kind_make_the_recorded_clearance(obstacles: Results) -> None:
    condition = obstacles.conditions[0]
    found = motions.approaches(condition)
    assert set(found["kind"]) == {motions.ARMS, motions.OBSTACLES}
    least = found.groupby("replicate")["clearance"].min()
    assert least.to_numpy() == pytest.approx(condition.column("clearance"), abs=1e-6)
    kept = found.groupby("replicate")["kept"].all().to_numpy()
    assert kept.tolist() == condition.summaries["certified_margin"].tolist()


def test_distances_to_obstacles_are_drawn_for_every_replicate(obstacles: Results) -> None:
    condition = obstacles.conditions[0]
    sampled = planar_motion.sampled_distances(condition, 5)
    table = planar_motion.distances_table(condition, sampled)
    for kind, margin in ((motions.ARMS, 1.0), (motions.OBSTACLES, 0.5)):
        own = table[table["kind"] == kind]
        assert set(own["safety_distance"]) == {margin}
        exact = own[own["series"].isin([planar_motion.CLOSEST, planar_motion.REFUTED])]
        assert len(exact) == condition.done, "no replicate is dropped"
    # by hand: the least distance of circle centres to the ball at (5, 4.6) of radius 0.4 and others
    problem = motions.problem(condition)
    q = problem.start[:, None]
    centres = np.vstack(problem.sphere_centres(problem.start))
    ball = np.linalg.norm(centres - [5.0, 4.6, 0.0], axis=1).min() - 0.4
    assert problem.obstacle_distances(q)[0] <= ball + 1e-9
    assert sampled["centres_to_obstacles"].min() >= 0.0
    titles = [axes.get_title() for axes in planar_motion.draw_distances(table).axes]
    assert [title[0] for title in titles] == ["a", "c", "b", "d"]


def test_extensions_have_claims_about_points_motions_and_margins(obstacles: Results) -> None:
    claims = page_of(obstacles, page_settings("rana_obstacles")).claims
    assert len(claims) == 3
    assert all("static obstacles" in claim.text for claim in claims)
    assert "required 0.5, kept in" in claims[2].evidence
    assert "required 1, kept in" in claims[2].evidence


def test_runs_without_a_free_individual_count_as_never(obstacles: Results) -> None:
    condition = obstacles.conditions[0]
    first = run_measures.first_feasible(condition)
    recorded = condition.column("first_feasible_generation")
    assert np.array_equal(np.isinf(first), np.isnan(recorded))
    assert len(first) == condition.done


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


def test_unevenness_is_the_sum_over_arms(obstacles: Results) -> None:
    condition = obstacles.conditions[0]
    q = motions.best_motion(condition)
    by_hand = 0.0
    for a, b in motions.problem(condition).arm_slices:
        steps = np.linalg.norm(np.diff(q[a:b], axis=1), axis=0)
        by_hand += float(np.abs(steps - steps.mean()).sum())
    place = list(condition.summaries.index).index(condition.best_replicate)
    assert measures.unevenness(condition)[place] == pytest.approx(by_hand, rel=1e-9)


def test_pairs_kept_apart_are_counted_against_all_pairs(outputs: Path) -> None:
    (condition, *_) = smoke_results(outputs, "rana_crossover", *WORDS).conditions
    shares = measures.kept_apart(condition)
    assert list(shares) == [0]  # three generations only
    planner, problem = condition.planner, motions.problem(condition)
    first = next(iter(generations(planner.evolve(problem, condition.condition.rng(0)))))
    strings = first.population[:, :, :12]
    apart = 0.0  # over all pairs and all sites of both arms
    near = [
        np.linalg.norm(strings[a:b, 1:-1, :, None] - strings[a:b, 1:-1, None, :], axis=0) < 100.0
        for a, b in problem.arm_slices
    ]
    for one in range(12):
        for two in range(12):
            if one != two:
                both = np.mean(near[0][:, one, two]) * np.mean(near[1][:, one, two])
                apart += (1.0 - both) / (12 * 11)
    assert shares[0] == pytest.approx(apart, abs=0.05)  # 2000 pairs: four standard errors


def test_the_page_of_the_cross_over_tells_its_distance(outputs: Path) -> None:
    results = smoke_results(outputs, "rana_crossover", *WORDS)
    page = page_of(results, page_settings("rana_crossover"))
    texts = [title for title, _ in page.checks]
    assert any("cross_over_distance = 100°" in text for text in texts)
    (told,) = (finding for title, finding in page.checks if title.startswith("Other distances"))
    assert all(label in told for label in ("25°", "50°", "200°", "any distance"))
    assert "no cross-over" not in told


def test_the_page_of_the_weights_tells_what_a_collision_costs(outputs: Path) -> None:
    results = smoke_results(outputs, "rana_collision_weight", *WORDS)
    page = page_of(results, page_settings("rana_collision_weight"))
    assert [row[1] for row in page.tables[0].rows] == ["10°", "1°", "3°", "30°", "100°"]
    printed = results.conditions[0]
    problem = motions.problem(printed)
    straight = sum(
        float(np.linalg.norm((problem.goal - problem.start)[a:b])) for a, b in ((0, 3), (3, 6))
    )
    assert f"{100 * 10 / straight:.1f} %" in page.claims[1].evidence
    q = motions.best_motion(printed)
    by_hand = sum(
        np.linalg.norm(np.diff(q[a:b], axis=1), axis=0).sum() for a, b in ((0, 3), (3, 6))
    )
    place = list(printed.summaries.index).index(printed.best_replicate)
    assert measures.length(printed)[place] == pytest.approx(by_hand, rel=1e-9)


def test_ablations_that_are_stored_judge_the_papers_page(
    outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = (*WORDS, "num_replicates=2")
    ablations = smoke_results(outputs, "rana_planar_ablations", *words)
    rows = tuple(
        Shipped("rana_planar_ablations", c.label, "paper", c.condition.id, "0" * 32)
        for c in ablations.conditions
    )
    never_run = Shipped("rana_planar_ablations", "never run", "paper", "f" * 64, "0" * 32)
    monkeypatch.setattr(report_results, "shipped", lambda: (*rows, never_run))
    results = smoke_results(outputs, "rana_planar", *words)
    beside = results.beside("rana_planar_ablations")
    assert {c.label for c in beside.conditions} == {c.label for c in ablations.conditions}
    assert [c.done for c in beside.conditions] == [2] * len(rows)
    claims = page_of(results, page_settings("rana_planar")).claims
    told = [claim for claim in claims if "Relaxation and redistribution" in claim.text]
    assert len([c for c in told if "refuted motions" in c.evidence]) == 3
    assert results.beside("rana_puma_ablations").conditions == ()


def test_what_evolution_adds_is_told_of_the_best_control_first(outputs: Path) -> None:
    results = smoke_results(outputs, "rana_planar", *WORDS, "num_replicates=2")
    (claim,) = (
        claim
        for claim in page_of(results, page_settings("rana_planar")).claims
        if claim.text.startswith("Evolution adds")
    )
    medians = {c.label: float(np.median(c.column("best_cost"))) for c in results.conditions[1:]}
    best = min(medians, key=lambda label: medians[label])
    assert f"to the best control, {best}, evolution adds" in claim.evidence
    assert "straight line −527.3" in claim.evidence
