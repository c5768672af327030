"""All parts of a report's page, to be imported from here by the papers and by guests.

A page is an entry of a paper's `page.yaml` (see `pages.page_file`), named by an entry point
`evoexp.pages`; or a function (`Results`, `ReportSettings`) → `Page`. Its functions read `Results`:
columns of summaries, generations, solutions, and the answers of the planner's protocol
(`ConditionResults.evaluate`, `motion`, `problem`). They return

- values of single runs, (done,), and counts of runs (`Proportion`);
- rows of tables and checks; `Comparison` (of `compared`) and `Family`;
- `Claim` (of a `Judge`, by the rules of the paper's `claims.yaml`, see `claim_rules`);
- tables of figures (columns by `records`, `groups`, `rounded`) and figures of tables (`style`);
  `PlayedRun` are the runs whose motions a figure shows: the page plays them beside it.

The seed is the unit of all statistics: `spread`, `Proportion`, `fisher_exact`, `holm`, ….
"""

from evoexp.report.figures import groups as groups
from evoexp.report.figures import marks as marks
from evoexp.report.figures import records as records
from evoexp.report.figures import rounded as rounded
from evoexp.report.figures import shares as shares
from evoexp.report.figures import style as style
from evoexp.report.pages import markdown as markdown
from evoexp.report.pages.page_parts import Claim as Claim
from evoexp.report.pages.page_parts import PlayedRun as PlayedRun
from evoexp.report.pages.page_parts import Quantity as Quantity
from evoexp.report.pages.page_words import quantity as quantity
from evoexp.report.report_settings import ReportSettings as ReportSettings
from evoexp.report.results import motion_geometry as motion_geometry
from evoexp.report.results import run_measures as run_measures
from evoexp.report.results.parameters import overridden as overridden
from evoexp.report.results.parameters import parameters as parameters
from evoexp.report.results.parameters import planned_replicates as planned_replicates
from evoexp.report.results.run_measures import certified as certified
from evoexp.report.results.run_measures import counted as counted
from evoexp.report.results.run_measures import grouped as grouped
from evoexp.report.results.run_measures import median_replicate as median_replicate
from evoexp.report.results.run_measures import num_joints as num_joints
from evoexp.report.results.run_measures import on_common_seeds as on_common_seeds
from evoexp.report.results.run_measures import planned_by as planned_by
from evoexp.report.results.run_measures import search_seconds as search_seconds
from evoexp.report.results.run_measures import solved as solved
from evoexp.report.results.run_measures import success as success
from evoexp.report.results.run_measures import where_solved as where_solved
from evoexp.report.results.stored_results import ConditionResults as ConditionResults
from evoexp.report.results.stored_results import Results as Results
from evoexp.report.results.stored_results import wrapped as wrapped
from evoexp.report.statistics import judging as judging
from evoexp.report.statistics.claim_rules import Rules as Rules
from evoexp.report.statistics.comparisons import Comparison as Comparison
from evoexp.report.statistics.comparisons import Family as Family
from evoexp.report.statistics.comparisons import FamilyComparison as FamilyComparison
from evoexp.report.statistics.comparisons import Measure as Measure
from evoexp.report.statistics.comparisons import Values as Values
from evoexp.report.statistics.comparisons import adjusted as adjusted
from evoexp.report.statistics.comparisons import beside as beside
from evoexp.report.statistics.comparisons import by_column as by_column
from evoexp.report.statistics.comparisons import compare_families as compare_families
from evoexp.report.statistics.comparisons import compared as compared
from evoexp.report.statistics.comparisons import rows_by_name as rows_by_name
from evoexp.report.statistics.inference import BOOTSTRAP_SEED as BOOTSTRAP_SEED
from evoexp.report.statistics.inference import Interval as Interval
from evoexp.report.statistics.inference import Proportion as Proportion
from evoexp.report.statistics.inference import effort_ratio as effort_ratio
from evoexp.report.statistics.inference import expected_effort as expected_effort
from evoexp.report.statistics.inference import expected_interval as expected_interval
from evoexp.report.statistics.inference import fisher_exact as fisher_exact
from evoexp.report.statistics.inference import holm as holm
from evoexp.report.statistics.inference import newcombe as newcombe
from evoexp.report.statistics.inference import quantile as quantile
from evoexp.report.statistics.inference import quantiles as quantiles
from evoexp.report.statistics.inference import spread as spread
from evoexp.report.statistics.judging import Judge as Judge
from evoexp.report.statistics.judging import evidence as evidence
from evoexp.report.statistics.judging import fisher_evidence as fisher_evidence
