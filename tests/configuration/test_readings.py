"""Entries of an experiment's conditions that are read in several ways."""

from pathlib import Path

import pytest

from evoexp.configuration.compose import expand
from evoexp.errors import SettingError

HEAD = """
# @package _global_
defaults:
  - override /robot: two_planar_2r
  - override /scenario: rana_planar
  - override /planner: rana_planar
  - override /ga: rana_planar
  - override /objective: rana_planar
  - override /collision: rana_planar
conditions:
"""


def labels(tmp_path: Path, entry: str) -> dict[str, str]:
    """Return label → hash of an experiment with this entry."""
    (tmp_path / "own.yaml").write_text(f"{HEAD}  {entry}\n")
    (experiment,) = expand([f"experiment={tmp_path / 'own.yaml'}"])
    return {label: condition.id for label, condition in experiment.conditions}


def test_every_reading_stands_alone_and_beside_the_others(tmp_path: Path) -> None:
    found = labels(
        tmp_path,
        '"planar": {beside: {"multi-start": [control=multi_start]}, '
        'readings: {"N = {}": ["planner.num_via_points=10,40"]}}',
    )
    assert list(found) == [
        "planar",
        "planar, multi-start",
        *("planar, N = 10", "planar, N = 40"),
        *("planar, N = 10, multi-start", "planar, N = 40, multi-start"),
    ]
    written_out = '"a": [planner.num_via_points=10, control=multi_start]'
    assert labels(tmp_path, written_out)["a"] == found["planar, N = 10, multi-start"]


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ('"a": {reading: {"b": []}}', "conditions.a.reading"),
        ('"a": {readings: [ga.num_elites=1]}', "conditions.a.readings"),
        ('"a": {readings: {"b": ga.num_elites=1}}', "conditions.a"),
        ('"a": {beside: {"b": [1]}}', "conditions.a"),
        ('"a": 3', "conditions.a"),
    ],
)
def test_an_entry_that_is_wrong_is_named(tmp_path: Path, entry: str, named: str) -> None:
    with pytest.raises(SettingError, match=named):
        labels(tmp_path, entry)
