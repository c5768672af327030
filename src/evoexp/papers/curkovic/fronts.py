"""Fronts of populations, as the log of a replicate holds them."""

from evoexp.records import FrontRow
from evoexp.report.results import ConditionResults, Results
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory


def read_fronts(results: Results, condition: ConditionResults, replicate: int) -> list[FrontRow]:
    """Return the criteria of a finished replicate's populations, one record per population.

    Args:
        results: The results that the condition is part of.
        condition: The condition.
        replicate: Number of the replicate.

    Raises:
        CorruptLog: If the log cannot be trusted.
    """
    return read_log(
        RunDirectory(results.outputs, condition.condition.id).log_path(replicate)
    ).fronts
