"""Rows and words of the page of a sweep: each combination, the effect of each setting, facets.

What does not depend on the sweep, the scene and the motion, is shown once, of the best condition.
The functions give what the page `sweep` of `page.yaml` names.
"""

from collections.abc import Callable, Iterator
from typing import Any

import pandas as pd

from evoexp.report.figures import records, sweeps
from evoexp.report.pages import markdown
from evoexp.report.results.run_measures import certified, search_seconds, success
from evoexp.report.results.stored_results import Results
from evoexp.report.results.swept_settings import Sweep, labelled, main_effects
from evoexp.report.statistics.comparisons import Values, by_column
from evoexp.report.statistics.inference import Proportion, spread

MOST_CURVES = 60  # curves of convergence on a page
SHARES = ("solved", "solved and proven free of contact")
MEASURES: dict[str, Values] = {  # that pages of sweeps tell, by name
    "best cost": by_column("best_cost"),
    "evaluations": by_column("evaluations"),
    "CPU time of the search [s]": search_seconds,
}


def best_condition(sweep: Sweep, results: Results) -> Results:
    """Return the results of the condition of the least median cost alone."""
    with_data = (each.results for each in sweep.conditions if each.results.done)
    best = sorted(with_data, key=lambda c: c.spread("best_cost").median)[:1]
    return results._replace(conditions=tuple(best))


def sweep_words(sweep: Sweep) -> dict[str, object]:
    """Return the words of the page's texts."""
    bases = [base for base in sweep.bases if base]
    panels = {(each.base, *each.values[:-2]) for each in sweep.conditions}
    return {
        "conditions": len(sweep.conditions),
        "combinations": len({each.values for each in sweep.conditions}),
        "names": " and ".join(f"`{name}`" for name in sweep.settings),
        "bases": f", each of {', '.join(bases)}" if len(bases) > 1 else "",
        "settings": labelled(sweep, ["…"] * len(sweep.settings)).replace(" = …", ""),
        "last": sweep.settings[-1],
        "more_grids": _more(len(panels)),
        "more_facets": _more(len(sweeps.facets(sweep))),
    }


def combinations(sweep: Sweep, confidence: float) -> Iterator[tuple[object, ...]]:
    """Yield a row per combination: shares of runs, and the spreads of what they took."""
    for each in sweep.conditions:
        c = each.results
        proven = Proportion(certified(c).having, c.done)
        shares = (runs.with_interval(confidence) for runs in (success(c), proven))
        yield (
            *((each.base,) if any(sweep.bases) else ()),
            *each.values,
            f"`{c.hash12}`",
            c.done,
            *(shares if c.done else ("–", "–")),
            *(markdown.spread(spread(of(c))) for of in MEASURES.values()),
        )


def effect_rows_by_value(effects: pd.DataFrame) -> Iterator[tuple[object, ...]]:
    """Yield a row per value that is compared with the first one of its setting."""
    for each in records(effects):
        difference, low, high = map(markdown.number, (each.difference, each.low, each.high))
        yield (
            *((each.base,) if effects["base"].any() else ()),
            each.setting,
            f"{each.first} → {each.other}",
            each.pairs,
            f"{difference} [{low}, {high}]",
            f"{100.0 * each.better:.0f} %",
        )


def _more(count: int) -> str:
    """Tell how many panels are left out; empty if none is."""
    most = sweeps.MOST_PANELS
    return f" The first {most} of {count} panels; the data have all." if count > most else ""


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "swept_conditions": lambda sweep: [c.results for c in sweep.conditions if c.results.done],
    "curves_are_few": lambda swept_conditions: 0 < len(swept_conditions) <= MOST_CURVES,
    "combination_headers": lambda sweep: (
        *["condition"] * any(sweep.bases),
        *(*sweep.settings, "hash", "n", *SHARES, *MEASURES),
    ),
    # effect of each value of each setting on the best cost
    "effects": lambda sweep, settings: main_effects(
        sweep, by_column("best_cost"), settings.confidence, settings.num_resamples
    ),
    "effect_table": lambda effects: effects,
    "effect_headers": lambda effects: (
        *["condition"] * bool(effects["base"].any()),
        *("setting", "value", "pairs", "change of the best cost", "better in"),
    ),
}
