"""Values of runs that the pages of several papers use."""

import numpy as np

from evoexp.records import BoolArray, FloatArray
from evoexp.report import kit


def num_joints(condition: kit.ConditionResults) -> int:
    """Return the number of joints of the arm, whose start the scenario names."""
    return len(condition.condition.scenario.q_start)  # type: ignore[attr-defined]


def certified(condition: kit.ConditionResults) -> kit.Proportion:
    """Count the solved runs whose motions the exact verdict certifies."""
    free = condition.summaries["certified"].eq(True).fillna(False).to_numpy(dtype=bool)
    return kit.counted(free[kit.solved(condition)])


def where_solved(values: kit.Values) -> kit.Values:
    """Return values of runs, (done,), that are infinite where a run is not solved."""
    return lambda condition: np.where(kit.solved(condition), values(condition), np.inf)


def on_common_seeds(
    one: kit.ConditionResults, two: kit.ConditionResults, values: kit.Values
) -> list[tuple[FloatArray, BoolArray]]:
    """Return values and success of the replicates that both conditions have, for each of both."""
    common = one.summaries.index.intersection(two.summaries.index)
    return [
        (values(c)[rows], kit.solved(c)[rows])
        for c in (one, two)
        for rows in (c.summaries.index.get_indexer(common),)
    ]
