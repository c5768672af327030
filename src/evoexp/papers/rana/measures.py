"""Measures of Rana & Zalzala 1995: motions of strings of via-points, quantities, operators."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import obstacle_pairs
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import BoolArray, FloatArray, generations
from evoexp.report.figures import DECIMALS, Rows, table_of
from evoexp.report.pages import markdown
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.run_measures import counted, grouped, summed
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons
from evoexp.report.statistics.comparisons import Family, FamilyComparison
from evoexp.report.statistics.inference import Proportion

AT, BETWEEN = "term_arm_distance_at_via_points", "term_arm_distance_between_sampled"
EVENNESS = "unevenness of the best, C3 + C4"
ARMS = {True: "two planar arms", False: "two PUMA-like arms"}
GENERATIONS = (0, 10, 50)  # whose pairs of strings are looked at
PAIRS = 2000  # drawn of each generation
BETWEEN_ARMS, TO_OBSTACLES = "between arms", "to obstacles"  # kinds of pairs of bodies
STRAIGHT = "straight line"
FRESH = 1000  # strings that nothing has selected
UNEVEN, EVEN = 2.0, 1.05  # ratios of the longest step of a path to its shortest one (ours)


# C3 + C4 + … of each run's best: sums of |step − mean step| (Eqs. 4, 5), (done,) [deg]
unevenness = summed("term_unevenness_arm_")


def best_motion(condition: ConditionResults) -> FloatArray:
    """Return the configurations of the best replicate's motion, (nq, instants) [deg]."""
    best = condition.solutions[condition.best_replicate]
    return motion_geometry.configurations(condition.prepared, best)


def straight_line(condition: ConditionResults) -> FloatArray:
    """Return the solution that goes straight from start to goal, flat [deg]."""
    found = condition.problem(Problem)
    return motion_geometry.straight_line(condition.planner.shape(found), found.start, found.goal)


def sampled(condition: ConditionResults, solution: FloatArray, samples: int) -> FloatArray:
    """Return a solution's motion, sampled per segment, (nq, instants) [deg]."""
    q = motion_geometry.configurations(condition.prepared, solution)
    return motion_geometry.dense(q, samples)[1]


def straight_centres(condition: ConditionResults, samples: int) -> float:
    """Return the least distance of centres along the straight line [length unit]."""
    q = sampled(condition, straight_line(condition), samples)
    return round(float(condition.problem(Problem).centre_distances(q).min()), DECIMALS)


def straight_length(condition: ConditionResults) -> float:
    """Return the length of the straight paths of all arms together [deg]."""
    found = condition.problem(Problem)
    gap = found.goal - found.start
    return float(sum(np.linalg.norm(gap[a:b]) for a, b in found.arm_slices))


def worth(condition: ConditionResults) -> float:
    """Return how many degrees of path cost as much as one colliding instant, k3 / k1."""
    weights = condition.planner.objective
    return float(weights.collision_weight / weights.length_weight)


def kinds_of_pairs(condition: ConditionResults) -> dict[str, tuple[np.ndarray, float]]:
    """Return the kinds of pairs of bodies: name → (pairs of the scene, required distance)."""
    found = condition.problem(Problem)
    among = obstacle_pairs(found.assembly, found.scene)
    kinds = {
        BETWEEN_ARMS: (~among, found.security_margin),
        TO_OBSTACLES: (among, found.obstacle_margin),
    }
    return {name: kind for name, kind in kinds.items() if kind[0].any()}


@table_of("kind replicate clearance clearance_at refuted_at kept")
def approaches(condition: ConditionResults) -> Rows:
    """Return how close the bodies of each kind of pairs come in every replicate's motion, exactly.

    `refuted_at` is NaN where they touch nowhere; `kept` says whether the required distance is.
    """
    for name, (kept, margin) in kinds_of_pairs(condition).items():
        bodies = condition.problem(Problem).scene.of_pairs(kept)
        for k in condition.solutions:
            verdict = certify(bodies, condition.motion(k), margin)
            where = verdict.clearance, verdict.clearance_at, verdict.refuted_at
            yield name, k, *where, verdict.margin_status == "certified"


def colliding_after(condition: ConditionResults, relaxed: bool) -> int:
    """Count the collision-free final strings that collide once redistributed (and relaxed)."""
    own, found = condition.planner, condition.problem(Problem)
    step = own.relaxation_step if relaxed else 0.0
    operator = own.model_copy(update={"redistribution": True, "relaxation_step": step})
    strings = [
        motion_geometry.configurations(condition.prepared, condition.solutions[int(k)])
        for k in condition.summaries.index[run_measures.solved(condition)]
    ]
    if not strings:
        return 0
    rng = np.random.Generator(np.random.PCG64(0))  # the operator draws nothing
    improved = operator.improve(found, np.stack(strings, axis=2), rng)
    return int(np.count_nonzero(~own.cost(found, improved).feasible))


def fits(results: Results) -> bool:
    """Return whether all have several arms of two joints in a plane, or of three in space."""
    for problem in (c.prepared.problem for c in results.with_data):
        if not isinstance(problem, Problem) or problem.assembly.num_arms < 2:
            return False
        joints = 2 if problem.assembly.table.planar else 3
        if any(stop - first < joints for first, stop in problem.arm_slices):
            return False
    return bool(results.with_data)


def planar(condition: ConditionResults) -> bool:
    """Return whether the arms move in a plane."""
    return bool(condition.problem(Problem).assembly.table.planar)


def margin(condition: ConditionResults) -> float:
    """Return the safety distance [length unit]."""
    return condition.problem(Problem).security_margin


def scenes(results: Results) -> list[tuple[Results, str]]:
    """Return all conditions of each scene, and the end of its figure's stem."""
    suffixes = {c.label: suffix for c, suffix in results.suffixed}
    found = [
        (results._replace(conditions=own), [suffixes[c.label] for c in own if c.label in suffixes])
        for own in grouped(results.conditions, lambda c: (c.robot, c.scenario))
    ]
    drawn = [(scene, own[0]) for scene, own in found if own]
    return [(scene, suffix if len(drawn) > 1 else "") for scene, suffix in drawn]


def refuted(condition: ConditionResults) -> Proportion:
    """Count the motions whose bodies touch."""
    counts = condition.verdicts
    return Proportion(counts.refuted, counts.judged)


def length(condition: ConditionResults) -> FloatArray:
    """Return the length of all arms' paths in each run's best string, (done,) [deg]."""
    ratio = condition.column("term_path_length_ratio")
    return np.asarray(straight_length(condition) * ratio)


def drawable(condition: ConditionResults) -> bool:
    """Return whether a condition's arms move in a plane and have two joints each."""
    problem = condition.prepared.problem
    if not isinstance(problem, Problem) or not problem.assembly.table.planar:
        return False
    return all(stop - first == 2 for first, stop in problem.arm_slices)


def _changing(conditions: Sequence[ConditionResults], name: str) -> list[ConditionResults]:
    """Return the conditions that differ from the first one in this setting, and no other."""
    of_paper = [c for c in conditions if isinstance(c.planner, ViaPointGa) and not c.is_control]
    first = conditions[0].planner
    return [
        c
        for c in of_paper
        if conditions[0] in of_paper
        and getattr(c.planner, name) != getattr(first, name)
        and c.planner.model_copy(update={name: getattr(first, name)}) == first
    ]


def _difference(
    other: ConditionResults, compared: tuple[FamilyComparison, ...], names: dict[str, str]
) -> str:
    rows = comparisons.rows_by_name(compared)
    told = [
        f"the median of {shown} differs by {markdown.number(row.median_difference)}, "
        f"p = {markdown.p_value(row.better.p_value)}"
        for name, shown in names.items()
        for row in rows[name]
        if row.quantity == other.label
    ]
    return "; ".join(told) or "nothing to compare"


def kept_apart(condition: ConditionResults) -> dict[int, float]:
    """Return the share of pairs that are too far apart to be crossed, by generation.

    The first replicate is run again for some generations; sites and pairs are drawn at random.
    """
    planner, problem = condition.planner, condition.problem(Problem)
    draw = np.random.Generator(np.random.PCG64(0))
    found = {}
    for generation in generations(planner.evolve(problem, condition.condition.rng(0))):
        if generation.index in GENERATIONS:
            strings = generation.population[:, :, : planner.ga.population_size]
            num_points, individuals = strings.shape[1:]
            apart = np.zeros(PAIRS, dtype=bool)
            if num_points >= 3 and individuals >= 2:
                one = draw.integers(individuals, size=PAIRS)
                two = (one + draw.integers(1, individuals, size=PAIRS)) % individuals
                for first, stop in problem.arm_slices:
                    site = draw.integers(1, num_points - 1, size=PAIRS)  # 1 … N − 1
                    gap = strings[first:stop, site, one] - strings[first:stop, site, two]
                    apart |= np.linalg.norm(gap, axis=0) >= planner.crossover_distance
            found[generation.index] = float(np.mean(apart))
        if generation.index >= max(GENERATIONS):
            break
    return found


def fresh(condition: ConditionResults, *, redistributed: bool) -> FloatArray:
    """Return new random walks (section 3.3), not relaxed, (nq, N + 1, `FRESH`) [deg]."""
    settings = {"redistribution": redistributed, "relaxation_step": 0.0}
    planner = condition.planner.model_copy(update=settings)
    rng = np.random.Generator(np.random.PCG64(0))
    return np.asarray(planner.sample(condition.problem(Problem), rng, FRESH))


def steps(condition: ConditionResults, q: FloatArray) -> list[FloatArray]:
    """Return the lengths of each arm's steps between via-points of q, (nq, N + 1, …) [deg]."""
    arms = condition.problem(Problem).arm_slices
    return [np.linalg.norm(np.diff(q[first:stop], axis=1), axis=0) for first, stop in arms]


def _unequal(condition: ConditionResults, strings: FloatArray, ratio: float) -> np.ndarray:
    """Return whether the steps of a path differ by more than a ratio, (arms, strings)."""
    return np.array([s.max(axis=0) > ratio * s.min(axis=0) for s in steps(condition, strings)])


def shortened(condition: ConditionResults) -> Proportion:
    """Count the fresh strings, redistributed, that one relaxation makes shorter."""
    strings = fresh(condition, redistributed=True)
    relaxing = condition.planner.model_copy(update={"redistribution": False})
    rng = np.random.Generator(np.random.PCG64(0))  # the operator draws nothing
    relaxed = relaxing.improve(condition.problem(Problem), strings, rng)
    before, after = (sum(s.sum(axis=0) for s in steps(condition, q)) for q in (strings, relaxed))
    return counted(np.less(after, before))


def crossed_jumps(condition: ConditionResults) -> Proportion:
    """Count the paths that cross-over leaves with a jump, of pairs of fresh redistributed strings.

    A child takes its path from another parent from a site on (section 3.4 b), as far as both are
    close there. A jump is a step into the site of more than `UNEVEN` mean steps of the child.
    """
    problem = condition.problem(Problem)
    strings = fresh(condition, redistributed=True)
    num_points, rng = strings.shape[1], np.random.Generator(np.random.PCG64(0))
    one, two = rng.permutation(FRESH).reshape(2, -1)
    crossed, jumps = np.ones(len(one), dtype=bool), []
    for first, stop in problem.arm_slices:
        own = strings[first:stop]
        site = rng.integers(1, num_points - 1, size=len(one))  # 1 … N − 1
        gap = np.linalg.norm(own[:, site, one] - own[:, site, two], axis=0)
        crossed &= gap < condition.planner.crossover_distance
        from_mate = np.arange(num_points)[:, None] >= site
        child = np.where(from_mate, own[:, :, two], own[:, :, one])
        step = np.linalg.norm(np.diff(child, axis=1), axis=0)
        jumps.append(step[site - 1, np.arange(len(site))] > UNEVEN * step.mean(axis=0))
    return counted(np.array(jumps)[:, crossed].ravel())


def falls(condition: ConditionResults, prefix: str) -> BoolArray:
    """Return whether terms with a prefix, summed, fell in each run or are 0 at its end, (done,).

    The best string of the last generation beside that of the first one.
    """
    found = []
    for replicate, solution in condition.solutions.items():
        first, last = (
            sum(value for name, value in condition.evaluate(q).items() if name.startswith(prefix))
            for q in (condition.first_solution(replicate), solution)
        )
        found.append(last < first or last == 0.0)
    return np.array(found)


def speed_variation(condition: ConditionResults) -> FloatArray:
    """Return how much joint speed varies along each run's best motion, (done,) [-].

    Standard deviation over mean of an arm's speed from via-point to via-point, which it passes in
    equal times; the mean of all arms.
    """
    found = []
    for solution in condition.solutions.values():
        speeds = steps(condition, motion_geometry.configurations(condition.prepared, solution))
        found.append(np.mean([speed.std() / speed.mean() for speed in speeds]))
    return np.array(found)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # how much longer than the straight line each run's best paths are, (done,) [deg]
    "longer": lambda condition: length(condition) - straight_length(condition),
    # least distance of centres between via-points in units of the safety distance, (done,) [-]
    "safety_share": lambda condition, margin: condition.column(BETWEEN) / margin,
    "median_longer": lambda longer: float(np.median(longer)),
    # the beginning of a line about a condition: nothing if there is no other one
    "who": lambda results, condition: f"{condition.label}: " if len(results.main) > 1 else "",
    "arms": lambda main: " and ".join(
        ARMS[flat] for flat in sorted(set(map(planar, main)), reverse=True)
    ),
    "is_flat": lambda scene: planar(scene.with_data[0]),
    # the first condition of each scene against the others there
    "scene_families": lambda scenes: [Family.of(scene.with_data) for scene, _ in scenes],
    "straight_terms": lambda condition: condition.evaluate(straight_line(condition)),
    # runs whose centres, or bodies, come closer than the safety distance
    "dips": lambda condition: int(np.sum(condition.column(BETWEEN) < margin(condition))),
    "closer": lambda condition: int(np.sum(condition.column("clearance") < margin(condition))),
    # free final strings that collide after redistribution, and after both operators
    "redistributed": lambda condition: colliding_after(condition, relaxed=False),
    "relaxed": lambda condition: colliding_after(condition, relaxed=True),
    # runs whose best string collides at a via-point by the paper's model
    "colliding": lambda condition: Proportion(condition.done - condition.solved, condition.done),
    "any_planar": lambda results: any(map(drawable, results.main)),
    # conditions that read "double cross-over" in another way than the first one, or cross strings
    # at other distances, and how far they are from it
    "crossover_readings": lambda conditions: _changing(conditions, "crossover_reading"),
    "crossover_distances": lambda conditions: _changing(conditions, "crossover_distance"),
    "cost_difference": lambda other, compared: _difference(
        other, compared, {"best cost": "best cost"}
    ),
    "reading_difference": lambda other, compared: _difference(
        other, compared, {"best cost": "best cost", EVENNESS: "unevenness C3 + C4"}
    ),
    "several_arms": lambda condition: (
        drawable(condition) and condition.problem(Problem).assembly.num_arms > 1
    ),
    # pairs that are too far apart to be crossed, in words
    "told_apart": lambda first: ", ".join(
        f"{100 * share:.1f} % in generation {generation}"
        for generation, share in kept_apart(first).items()
    ),
    # k1 / k2: how many times the weight of unevenness that of the length is
    "length_over_unevenness": lambda condition: (
        condition.planner.objective.length_weight / condition.planner.objective.unevenness_weight
    ),
    # paths of fresh walks whose steps are uneven, and of redistributed ones whose steps are even
    "uneven_walks": lambda condition: counted(
        _unequal(condition, fresh(condition, redistributed=False), UNEVEN).ravel()
    ),
    "even_paths": lambda condition: counted(
        ~_unequal(condition, fresh(condition, redistributed=True), EVEN).ravel()
    ),
    # runs in which a criterion of the best string fell, or is 0 at the end
    "shorter": lambda condition: falls(condition, "length_arm_"),
    "evener": lambda condition: falls(condition, "unevenness_arm_"),
    "fewer_collisions": lambda condition: falls(condition, "collisions"),
}
