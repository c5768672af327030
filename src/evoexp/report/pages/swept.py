"""The page of a sweep: each combination, the effect of each setting, convergence in facets.

What does not depend on the sweep, the scene and the motion, is shown once, of the best condition.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from evoexp.report.figures import sweeps
from evoexp.report.pages import generic, markdown, motion_pictures
from evoexp.report.pages.page_parts import Drawing, Page, Table
from evoexp.report.pages.page_words import WORDS
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.results.swept_settings import MainEffect, Sweep, labelled, main_effects, measures
from evoexp.report.statistics.inference import Proportion, spread

MOST_CURVES = 60  # curves of convergence on a page


def page(results: Results, sweep: Sweep, settings: ReportSettings) -> Page:
    """Build the page of a sweep."""
    cost = measures()["best cost"]
    effects = tuple(main_effects(sweep, cost, settings.confidence, settings.num_resamples))
    done = [each.results for each in sweep.conditions if each.results.done]
    bases = [base for base in sweep.bases if base]
    words = WORDS.introduction(
        "sweep",
        conditions=len(sweep.conditions),
        combinations=len({each.values for each in sweep.conditions}),
        settings=" and ".join(f"`{name}`" for name in sweep.settings),
        bases=f", each of {', '.join(bases)}" if len(bases) > 1 else "",
    )
    if len({(c.condition.robot, c.condition.scenario) for c in done}) > 1:
        words += f" {generic.SCENES}"
    # scene and motion of the condition with the lowest median cost alone
    best = sorted(done, key=lambda c: spread(c.column("best_cost")).median)[:1]
    shown = motion_pictures.best_motions(results._replace(conditions=tuple(best)))
    return Page(
        title=f"{results.experiment or 'stored runs'}: a sweep",
        introduction=words,
        quantities=(),
        tables=(_combinations(sweep, settings), *_effect_tables(effects, settings)),
        drawings=(
            *_drawings(results, sweep, effects),
            *motion_pictures.drawings(shown),
        ),
    )


def _combinations(sweep: Sweep, settings: ReportSettings) -> Table:
    values = measures()
    rows = tuple(
        (
            *((each.base,) if any(sweep.bases) else ()),
            *each.values,
            f"`{each.results.condition.id[:12]}`",
            each.results.done,
            *_shares(each.results, settings),
            *(markdown.spread(spread(of(each.results))) for of in values.values()),
        )
        for each in sweep.conditions
    )
    first = ("condition",) if any(sweep.bases) else ()
    shares = ("solved", "solved and proven free of contact")
    headers = (*first, *sweep.settings, "hash", "n", *shares, *values)
    return WORDS.table("combinations", rows, headers)


def _shares(condition: ConditionResults, settings: ReportSettings) -> tuple[str, str]:
    if not condition.done:
        return "–", "–"
    solved = condition.summaries["solved"].to_numpy(dtype=bool)
    proven = condition.summaries["certified"].fillna(False).to_numpy(dtype=bool) & solved
    told = (Proportion(int(np.count_nonzero(which)), condition.done) for which in (solved, proven))
    one, two = (each.with_interval(settings.confidence, 0) for each in told)
    return one, two


def _effect_tables(effects: tuple[MainEffect, ...], settings: ReportSettings) -> Iterator[Table]:
    if not effects:
        return
    rows = tuple(
        (
            *((each.base,) if any(e.base for e in effects) else ()),
            each.setting,
            f"{each.first} → {each.other}",
            each.num_pairs,
            f"{markdown.number(each.difference)} [{markdown.number(each.interval.low)}, "
            f"{markdown.number(each.interval.high)}]",
            f"{100.0 * each.better:.0f} %",
        )
        for each in effects
    )
    first = ("condition",) if any(each.base for each in effects) else ()
    yield WORDS.table("main_effects", rows, first, level=100.0 * settings.confidence)


def _drawings(results: Results, sweep: Sweep, effects: tuple[MainEffect, ...]) -> Iterator[Drawing]:
    conditions = tuple(each.results for each in sweep.conditions if each.results.done)
    if not conditions:
        return
    where = labelled(sweep, ["…"] * len(sweep.settings)).replace(" = …", "")
    for stem, name in (("grid_cost", "best cost"), ("grid_cpu", "CPU time of the search [s]")):
        functions = sweeps.grid_table, partial(sweeps.draw_grid, name=name)
        words: dict[str, Any] = {
            "stem": stem,
            "quantity": f"{name[0].upper()}{name[1:]}",
            "where": where,
        }
        words["more"] = _more(len({(each.base, *each.values[:-2]) for each in sweep.conditions}))
        yield WORDS.drawing("grid", functions, conditions, sweep, measures()[name], **words)
    if effects:
        yield WORDS.drawing("main_effects", sweeps.EFFECTS, conditions, effects)
    if len(conditions) <= MOST_CURVES:
        more, given = _more(len(sweeps.facets(sweep))), (conditions, results, sweep)
        setting = sweep.settings[-1]
        yield WORDS.drawing(
            "sweep_convergence", sweeps.CONVERGENCE, *given, setting=setting, more=more
        )


def _more(count: int) -> str:
    """Tell how many panels are left out; empty if none is."""
    most = sweeps.MOST_PANELS
    return f" The first {most} of {count} panels; the data have all." if count > most else ""
