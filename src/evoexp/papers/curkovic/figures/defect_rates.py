"""The share of motions of every condition that have a defect, with intervals."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import shares
from evoexp.report.proportions import Proportion

NAMES = {"quantity": "defect", "having": "failing", "total": "solved"}  # of shares, of defects


def rates_table(
    rows: Sequence[tuple[str, int, str, Proportion]], confidence: float
) -> pd.DataFrame:
    """Return shares of motions.

    Args:
        rows: (defect, position, condition, failing ones of the solved motions).
        confidence: Level of Wilson's intervals.

    Returns:
        Columns defect, position, condition, failing, solved, lower, upper, share.
    """
    table = shares.shares_table(rows, {}, confidence).rename(columns=NAMES)
    order = ["defect", "position", "condition", "failing", "solved", "lower", "upper"]
    return table[order].assign(share=table["share"].fillna(0.0))


def draw_rates(table: pd.DataFrame) -> Figure:
    """Draw one panel per defect, one row per condition."""
    named = table.rename(columns={of_defects: of_shares for of_shares, of_defects in NAMES.items()})
    return shares.draw_shares(named.assign(printed=np.nan), "share of solved motions [%]")
