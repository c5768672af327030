"""All parts of a report's page, to be imported from here by the papers and by guests.

A page is a function (`Results`, `ReportSettings`) → `Page`, named by an entry point `evoexp.pages`.
It reads `Results`: columns of summaries, generations, solutions, and the answers of the planner's
protocol (`ConditionResults.evaluate`, `motion`, `problem`). Its parts are:

- `Table`, `Quantity` (of `generic.quantity`), `Claim` (of a `Judge`, by the rules of the paper's
  `claims.yaml`, see `claim_rules` and `judging.judge`),
  `Comparison` (of `compared`) and `Drawing`, each with its words in `markdown`;
- a `Drawing` is two functions: results → table (columns by `records`, `groups`, `rounded`), and
  table → figure (`style`); `sweep_figures` has those that all sweeps share; its `plays` name the
  runs whose motions it shows (`PlayedRun`): the page plays them beside it;
- the seed is the unit of all statistics: `spread`, `Proportion`, `fisher_exact`, `holm`, ….
"""

from evoexp.report import (
    body_contacts,
    distance_ranges,
    judging,
    markdown,
    motion_geometry,
    run_measures,
    style,
    sweep_figures,
    verdicts,
)
from evoexp.report.claim_rules import read_rules
from evoexp.report.comparisons import Values, beside, by_column, compared, compared_with_controls
from evoexp.report.figures import convergence, shares
from evoexp.report.judging import Judge, evidence
from evoexp.report.page_parts import Drawing, Page, PlayedRun, Quantity, Table
from evoexp.report.pages import assumptions, generic
from evoexp.report.pages.assumptions import Headline
from evoexp.report.parameters import overridden, parameters, planned_replicates
from evoexp.report.proportions import Proportion, fisher_exact, newcombe
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results, wrapped
from evoexp.report.rows import groups, records, rounded
from evoexp.report.run_measures import (
    counted,
    grouped,
    median_replicate,
    planned_by,
    search_seconds,
    solved,
    success,
)
from evoexp.report.statistics import (
    BOOTSTRAP_SEED,
    Interval,
    effort_ratio,
    expected_effort,
    expected_interval,
    holm,
    quantile,
    quantiles,
    spread,
)
from evoexp.report.verdicts import Claim, Comparison

__all__ = [
    "BOOTSTRAP_SEED",
    "Claim",
    "Comparison",
    "ConditionResults",
    "Drawing",
    "Headline",
    "Interval",
    "Judge",
    "Page",
    "PlayedRun",
    "Proportion",
    "Quantity",
    "ReportSettings",
    "Results",
    "Table",
    "Values",
    "assumptions",
    "beside",
    "body_contacts",
    "by_column",
    "compared",
    "compared_with_controls",
    "convergence",
    "counted",
    "distance_ranges",
    "effort_ratio",
    "evidence",
    "expected_effort",
    "expected_interval",
    "fisher_exact",
    "generic",
    "grouped",
    "groups",
    "holm",
    "judging",
    "markdown",
    "median_replicate",
    "motion_geometry",
    "newcombe",
    "overridden",
    "parameters",
    "planned_by",
    "planned_replicates",
    "quantile",
    "quantiles",
    "read_rules",
    "records",
    "rounded",
    "run_measures",
    "search_seconds",
    "shares",
    "solved",
    "spread",
    "style",
    "success",
    "sweep_figures",
    "verdicts",
    "wrapped",
]
