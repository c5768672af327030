"""Potential fields: the printed ones of the paper but for its slips.

And what settings are refused.
"""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.papers.chen.figures.printed_fields import (
    MISSING,
    SURPLUS,
    WRONG,
    compare,
    printed,
    rows_of,
)

PRINTED = {"neighbourhood": 1, "goal_potentials": (1.0, 3.0, 5.0)}
PRINTED |= {"obstacle_potentials": (10.0, 9.0, 7.0, 5.0, 3.0, 1.0)}


def settings(**changed: Any) -> PotentialFields:
    return PotentialFields(**(PRINTED | changed))


def test_both_fields_are_the_printed_ones_but_for_known_slips() -> None:
    _, problem = composed("experiment=chen_fields").prepare()
    own = problem.fields.grid
    goal = own.inner(problem.fields.goal_field(problem.ends[1]))
    unsafeness, blocked = own.inner(problem.fields.unsafeness), np.isnan(goal)
    slips = []
    for name, values, edge, given in zip(
        "ab", (goal, unsafeness), "*" + "x", printed("chen_fig_1.txt"), strict=True
    ):
        table = compare(name, rows_of(values, blocked, "10" if edge == "x" else edge), given)
        assert int((table["slip"] == "").sum()) >= 254
        slips += [
            (r.field, r.row, r.column, r.slip)
            for r in table[table["slip"] != ""].itertuples(index=False)
        ]
    assert slips == [
        ("a", 4, 13, SURPLUS), ("a", 5, 12, SURPLUS), ("a", 9, 13, WRONG),
        ("b", 6, 5, MISSING), ("b", 6, 16, SURPLUS), ("b", 12, 7, WRONG),
    ]  # fmt: skip


def test_potentials_go_on_or_are_held() -> None:
    fields = settings().bind(np.zeros((30, 30), dtype=bool))
    start = fields.grid.index_of((0, 0))
    assert fields.grid.inner(fields.goal_field(start))[3, 4] == 13.0  # 2 · 7 − 1
    unsafeness = fields.grid.inner(fields.unsafeness)
    assert unsafeness[0, 0] == 9.0
    assert unsafeness[15, 15] == 1.0
    assert unsafeness[4, 15] == 1.0
    assert unsafeness[3, 15] == 3.0


def test_fields_in_space() -> None:
    blocked = np.zeros((9, 9, 9), dtype=bool)
    blocked[4, 4, 4] = True
    for neighbourhood, steps in ((1, 6), (2, 3), (3, 2)):
        fields = settings(neighbourhood=neighbourhood).bind(blocked)
        found = fields.grid.inner(fields.steps_to(fields.grid.index_of((1, 1, 1))))
        assert found[3, 3, 3] == steps
        assert fields.grid.inner(fields.unsafeness)[3, 4, 4] == 9.0


def test_nodes_above_the_cap_are_no_places_to_be() -> None:
    fields = settings(max_unsafeness=7.0).bind(np.zeros((6, 6), dtype=bool))
    inner = fields.grid.inner(fields.grid.free.ravel())
    assert not inner[0].any()
    assert inner[1:-1, 1:-1].all()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"goal_potentials": (1.0, 1.0)}, "ascending"),
        ({"obstacle_potentials": (1.0, 2.0)}, "descending"),
    ],
)
def test_potentials_are_ordered(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(SettingError, match=said):
        settings(**changed)


def test_a_neighbourhood_is_one_of_the_grid() -> None:
    with pytest.raises(
        SettingError, match=r"collision\.neighbourhood: must be at most .* \(2\), was 3"
    ):
        settings(neighbourhood=3).bind(np.zeros((4, 4), dtype=bool))
