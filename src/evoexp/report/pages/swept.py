"""The page of a sweep: each combination, the effect of each setting, convergence in facets.

What does not depend on the sweep, the scene and the motion, is shown once, of the best condition.
"""

from collections.abc import Iterator

from evoexp.report.figures import sweeps
from evoexp.report.pages import markdown
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import certified, search_seconds, success
from evoexp.report.results.stored_results import Results
from evoexp.report.results.swept_settings import MainEffect, Sweep, labelled, main_effects, measures
from evoexp.report.statistics.comparisons import by_column
from evoexp.report.statistics.inference import Proportion, spread

MOST_CURVES = 60  # curves of convergence on a page
SHARES = ("solved", "solved and proven free of contact")


def page(results: Results, sweep: Sweep, settings: ReportSettings) -> Page:
    """Build the page of a sweep."""
    cost, of_base = by_column("best_cost"), ("condition",)
    effects = tuple(main_effects(sweep, cost, settings.confidence, settings.num_resamples))
    done = [each.results for each in sweep.conditions if each.results.done]
    bases = [base for base in sweep.bases if base]
    best = sorted(done, key=lambda c: spread(cost(c)).median)[:1]
    headers = (*sweep.settings, "hash", "n", *SHARES, *measures())
    return own_page(
        "sweep",
        results,
        settings,
        sweep=sweep,
        num_conditions=len(sweep.conditions),
        num_combinations=len({each.values for each in sweep.conditions}),
        swept_names=" and ".join(f"`{name}`" for name in sweep.settings),
        bases=f", each of {', '.join(bases)}" if len(bases) > 1 else "",
        combination_headers=(*of_base * bool(bases), *headers),
        combinations=tuple(_combinations(sweep, settings.confidence)),
        effects=effects,
        effect_headers=of_base * any(each.base for each in effects),
        effect_rows_by_value=tuple(_effect_rows(effects)),
        swept_conditions=done,
        curves_are_few=0 < len(done) <= MOST_CURVES,
        swept_settings=labelled(sweep, ["…"] * len(sweep.settings)).replace(" = …", ""),
        last_setting=sweep.settings[-1],
        cost_of_runs=cost,
        search_seconds_of_runs=search_seconds,
        more_grids=_more(len({(each.base, *each.values[:-2]) for each in sweep.conditions})),
        more_facets=_more(len(sweeps.facets(sweep))),
        motion_results=results._replace(conditions=tuple(best)),
    )


def _combinations(sweep: Sweep, confidence: float) -> Iterator[tuple[object, ...]]:
    """Yield a row per combination: shares of runs, and the spreads of what they took."""
    for each in sweep.conditions:
        c = each.results
        proven = Proportion(certified(c).having, c.done)
        shares = (runs.with_interval(confidence) for runs in (success(c), proven))
        yield (
            *((each.base,) if any(sweep.bases) else ()),
            *each.values,
            f"`{c.condition.id[:12]}`",
            c.done,
            *(shares if c.done else ("–", "–")),
            *(markdown.spread(spread(of(c))) for of in measures().values()),
        )


def _effect_rows(effects: tuple[MainEffect, ...]) -> Iterator[tuple[object, ...]]:
    """Yield a row per value that is compared with the first one of its setting."""
    number = markdown.number
    for each in effects:
        low, high = map(number, each.interval)
        yield (
            *((each.base,) if any(e.base for e in effects) else ()),
            each.setting,
            f"{each.first} → {each.other}",
            each.num_pairs,
            f"{number(each.difference)} [{low}, {high}]",
            f"{100.0 * each.better:.0f} %",
        )


def _more(count: int) -> str:
    """Tell how many panels are left out; empty if none is."""
    most = sweeps.MOST_PANELS
    return f" The first {most} of {count} panels; the data have all." if count > most else ""
