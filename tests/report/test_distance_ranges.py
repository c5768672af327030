"""Ranges over the motions of many replicates: those of all values at once."""

import numpy as np
import pytest

from evoexp.records import FloatArray
from evoexp.report.results import motion_geometry


def motions(lengths: list[int]) -> list[FloatArray]:
    """Random motions (2, instants) of some lengths; the first two are equal where both are."""
    rng = np.random.default_rng(3)
    found = [rng.normal(size=(2, length)) for length in lengths]
    if len(found) > 1:
        shared = min(lengths[:2])
        found[1][:, :shared] = found[0][:, :shared]
    return found


@pytest.mark.parametrize(
    "lengths",
    [[5], [5] * 7, [3, 5, 4, 5], [4] * 503],
    ids=["one", "some", "lengths that differ", "many"],
)
def test_extremes_are_those_of_all_values(lengths: list[int]) -> None:
    every = motions(lengths)
    found, negative = motion_geometry.extremes(
        range(len(every)),
        lambda k: every[k],
        [lambda q: q[0] + q[1], lambda q: -q[0] - q[1]],
    )
    table = np.full((len(every), max(lengths)), np.nan)
    for row, q in zip(table, every, strict=True):
        row[: q.shape[1]] = q[0] + q[1]
    np.testing.assert_array_equal(found.lowest, np.nanmin(table, axis=0))
    np.testing.assert_array_equal(found.highest, np.nanmax(table, axis=0))
    np.testing.assert_array_equal(negative.lowest, -found.highest)
    for values, q in ((found.lowest, found.at_lowest), (found.highest, found.at_highest)):
        np.testing.assert_array_equal(q[0] + q[1], values)


def test_the_first_of_equal_replicates_is_kept() -> None:
    first, second = np.array([[1.0, 5.0]]), np.array([[2.0, 6.0]])
    (found,) = motion_geometry.extremes([0, 1], [first, second].__getitem__, [lambda q: 0.0 * q[0]])
    np.testing.assert_array_equal(found.at_lowest, first)
    np.testing.assert_array_equal(found.at_highest, first)
