"""The page of the collision weight k3: what a collision costs beside a longer path."""

import numpy as np

from evoexp.papers.rana import motions, operators_page
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, run_measures, sweep_figures

LENGTH = "path length of the best, all arms"
COLLIDING = (
    "Share of runs whose best string collides at a via-point by the paper's model, or whose "
    "bodies touch somewhere on the whole motion, with Wilson's interval."
)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page, or the generic page if other planners were run."""
    if not run_measures.planned_by(results, ViaPointGa):
        return generic.page(results, settings)
    first, *others = results.with_data
    judge = judging.judge(results, settings, RULES)
    rows = kit.compared([(first, other) for other in others], length, settings)
    counts = [  # runs that end in a collision: at a via-point, anywhere
        (c, kit.Proportion(c.done - c.solved, c.done), operators_page.refuted(c))
        for c in results.with_data
    ]
    return PAPER.page(
        results,
        "weights",
        quantities=PAPER.quantities(results, "weights", {"length": length}),
        claims=tuple(_claims(judge, first)),
        comparisons=((f"{LENGTH}: {first.label} against …", rows),) if rows else (),
        tables=(_table(counts),),
        drawings=(
            sweep_figures.values_drawing(
                results,
                {
                    "path length [deg]": length,
                    "colliding instants C5": kit.by_column("term_collisions"),
                },
            ),
            sweep_figures.shares_drawing(
                results,
                settings,
                [
                    (name, results.position(c.label), c.label, count)
                    for place, name in enumerate(("collides at a via-point", "bodies touch"))
                    for c, *both in counts
                    for count in (both[place],)
                ],
                COLLIDING,
            ),
        ),
    )


def length(condition: kit.ConditionResults) -> FloatArray:
    """Return the length of all arms' paths in each run's best string, (done,) [deg]."""
    ratio = condition.column("term_path_length_ratio")
    return np.asarray(motions.straight_length(condition) * ratio)


def _claims(judge: kit.Judge, printed: kit.ConditionResults) -> list[kit.Claim]:
    straight, worth = motions.straight_length(printed), motions.worth(printed)
    hits = printed.evaluate(motions.straight_line(printed))["collisions"]
    told = f"{markdown.share(printed.solved, printed.done)} finished runs end free at via-points"
    done, planned, share = printed.done, printed.planned, worth / straight
    evidence = (
        f"one colliding instant costs as much as {markdown.number(worth)}° of path, "
        f"{100 * share:.1f} % of the straight paths' {markdown.number(straight)}°; the straight "
        f"line collides at {hits:.0f} instants, the best strings are longer by "
        f"{markdown.number(float(np.median(length(printed))) - straight)}° in the median"
    )
    outweighs = judge.on("collisions_outweigh_paths")
    least = outweighs.rule.limits["share"]
    return [
        judge.on("collisions_avoided").every(told, printed.solved, done, planned),
        outweighs.own(evidence, done, True if share >= 1.0 else False if share < least else None),
    ]


def _table(counts: list[tuple[kit.ConditionResults, kit.Proportion, kit.Proportion]]) -> kit.Table:
    rows = tuple(
        (
            c.label,
            f"{markdown.number(motions.worth(c))}°",
            markdown.share(at.having, at.total),
            markdown.share(anywhere.having, anywhere.total),
            f"{markdown.number(float(np.median(length(c))))}°",
        )
        for c, at, anywhere in counts
    )
    return PAPER.table("costs", rows)
