"""Values that every page may name: the parts of its results and settings, its comparisons."""

from evoexp.report.pages.page_parts import PlayedRun
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.claim_rules import Rules
from evoexp.report.statistics.comparisons import Family
from evoexp.report.statistics.judging import Judge


def experiment(results: Results) -> str:
    """Return the name of the experiment, as titles have it."""
    return results.experiment or "stored runs"


def conditions(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions with data."""
    return results.with_data


def main(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions with data without controls and references."""
    return results.main


def first(results: Results) -> ConditionResults:
    """Return the first condition with data."""
    return results.with_data[0]


def unit(first: ConditionResults) -> str:
    """Return the unit of length of the first condition's scene."""
    return first.condition.length_unit


def confidence(settings: ReportSettings) -> float:
    """Return the level of every interval, in (0, 1)."""
    return settings.confidence


def level(settings: ReportSettings) -> float:
    """Return the level of every interval [%]."""
    return 100 * settings.confidence


def judge(results: Results, settings: ReportSettings, rules: Rules) -> Judge:
    """Return the judge of the paper's claims."""
    return judging.judge(results, settings, rules)


def several(results: Results) -> bool:
    """Return whether there is something to compare: two conditions with data or more."""
    return len(results.with_data) > 1


def samples(settings: ReportSettings) -> int:
    """Return the configurations per segment of a path at which figures measure distances."""
    return settings.samples_per_segment


def whole(conditions: tuple[ConditionResults, ...]) -> tuple[Family, ...]:
    """Return the first condition against all others."""
    return (Family.of(conditions),)


def played(condition: ConditionResults) -> tuple[PlayedRun, ...]:
    """Return the best replicate, whose motion a figure shows."""
    return (PlayedRun(condition, condition.best_replicate),)
