"""Quantities of single runs that several pages of Rana & Zalzala compare."""

import numpy as np

from evoexp.records import FloatArray
from evoexp.report.kit import ConditionResults

UNEVENNESS = "term_unevenness_arm_"
FIRST_FREE = "first generation with a collision-free individual (∞: none in the whole run)"


def unevenness(condition: ConditionResults) -> FloatArray:
    """Return C3 + C4 + … of each run's best: sums of |step − mean step| (Eqs. 4, 5), (done,) [deg].

    NaN where the planner has no such terms.
    """
    columns = [name for name in condition.summaries if str(name).startswith(UNEVENNESS)]
    if not columns:
        return np.full(condition.done, np.nan)
    return np.asarray(np.sum([condition.column(str(name)) for name in columns], axis=0))
