"""The page of planar arms with two joints each: convergence, snapshots, paths, distances."""

from collections.abc import Iterator
from functools import partial

from evoexp.papers.rana import measures, motions
from evoexp.papers.rana.figures import planar_motion
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, run_measures


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of planar arms, or the generic page if no robot is drawable."""
    shown = [(c, suffix) for c, suffix in results.suffixed if drawable(c)]
    if not shown:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    judge = judging.judge(results, settings, RULES)
    drawings, claims = list(base.drawings), list[kit.Claim]()
    for condition, suffix in shown:
        drawings += _drawings(condition, suffix, settings.samples_per_segment)
        claims += _claims(judge, condition)
    cost, _, *effort = base.quantities
    first = kit.quantity(results, measures.FIRST_FREE, "generation", run_measures.first_feasible)
    return PAPER.page(
        results,
        "planar",
        base,
        quantities=(cost, first, *effort),
        claims=tuple(claims),
        drawings=tuple(drawings),
    )


def _claims(judge: kit.Judge, condition: kit.ConditionResults) -> Iterator[kit.Claim]:
    """Judge section 5's claims of extension: static obstacles, more than two arms."""
    problem, unit = condition.problem(Problem), condition.condition.length_unit
    arms, kinds = problem.assembly.num_arms, motions.kinds_of_pairs(condition)
    extensions = []
    if motions.OBSTACLES in kinds:
        extensions.append("The algorithm can easily be extended to static obstacles")
    if arms > 2:
        extensions.append(f"The algorithm plans for any multi-arm system, here for {arms} arms")
    exact, verdicts = motions.approaches(condition), condition.verdicts
    told = [
        f"{kind} {markdown.number(float(own['clearance'].min()))} {unit} at least (required "
        f"{margin:g}, kept in {markdown.share(int(own['kept'].sum()), len(own))})"
        for kind, (_, margin) in kinds.items()
        for own in (exact[exact["kind"] == kind],)
    ]
    for name in extensions:
        for rule, evidence, holds in (
            ("extends_at_via_points", "finished runs", condition.solved),
            ("extends_whole_motion", "motions certified", verdicts.certified),
            ("extends_with_margin", f"motions keep them; {', '.join(told)}", verdicts.with_margin),
        ):
            text = f"{markdown.share(holds, condition.done)} {evidence}"
            hearing = judge.on(rule, extension=name)
            yield hearing.every(text, holds, condition.done, condition.planned)


def drawable(condition: kit.ConditionResults) -> bool:
    """Return whether a condition's arms move in a plane and have two joints each."""
    problem = condition.prepared.problem
    if not isinstance(problem, Problem) or not problem.assembly.table.planar:
        return False
    return all(stop - first == 2 for first, stop in problem.arm_slices)


def _drawings(condition: kit.ConditionResults, suffix: str, samples: int) -> Iterator[kit.Drawing]:
    """Yield snapshots and paths of one condition, and distances if it has several arms."""
    c, played = condition, (kit.PlayedRun(condition, condition.best_replicate),)
    snapshots, draw = partial(planar_motion.snapshots_table, c), planar_motion.draw_snapshots
    yield PAPER.drawing("snapshots", (snapshots, draw), (c,), plays=played, suffix=suffix)
    paths = partial(planar_motion.paths_table, c)
    yield PAPER.drawing("paths", (paths, planar_motion.draw_paths), (c,), suffix=suffix)
    if c.problem(Problem).assembly.num_arms > 1:
        sampled = planar_motion.sampled_distances(c, samples)
        distances = partial(planar_motion.distances_table, c, sampled)
        yield PAPER.drawing(
            "distances", (distances, planar_motion.draw_distances), (c,), suffix=suffix
        )
