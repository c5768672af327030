"""Potential fields: the printed ones of the paper but for its slips; what is refused."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.papers.chen.figures import printed_fields as paper

PRINTED = {"neighbourhood": 1, "goal_potentials": (1.0, 3.0, 5.0)}
PRINTED |= {"obstacle_potentials": (10.0, 9.0, 7.0, 5.0, 3.0, 1.0)}


def bound(shape: tuple[int, ...], *blocked: tuple[int, ...], **changed: Any) -> Any:
    grid = np.zeros(shape, dtype=bool)
    for node in blocked:
        grid[node] = True
    return PotentialFields(**(PRINTED | changed)).bind(grid)


def test_both_fields_are_the_printed_ones_but_for_known_slips() -> None:
    _, problem = composed("experiment=chen_fields").prepare()
    own = problem.fields.grid
    goal = own.inner(problem.fields.goal_field(problem.ends[1]))
    unsafeness, blocked = own.inner(problem.fields.unsafeness), np.isnan(goal)
    slips = []
    for name, values, edge, given in zip(
        "ab", (goal, unsafeness), ("*", "10"), paper.printed("chen_fig_1.txt"), strict=True
    ):
        table = paper.compare(name, paper.rows_of(values, blocked, edge), given)
        wrong = table[table["slip"] != ""]
        assert len(table) - len(wrong) >= 254
        slips += list(wrong[["field", "row", "column", "slip"]].itertuples(index=False, name=None))
    assert slips == [
        ("a", 4, 13, paper.SURPLUS), ("a", 5, 12, paper.SURPLUS), ("a", 9, 13, paper.WRONG),
        ("b", 6, 5, paper.MISSING), ("b", 6, 16, paper.SURPLUS), ("b", 12, 7, paper.WRONG),
    ]  # fmt: skip


def test_potentials_go_on_or_are_held() -> None:
    fields = bound((30, 30))
    start = fields.grid.index_of((0, 0))
    assert fields.grid.inner(fields.goal_field(start))[3, 4] == 13.0  # 2 · 7 − 1
    unsafeness = fields.grid.inner(fields.unsafeness)
    assert [unsafeness[node] for node in ((0, 0), (3, 15), (4, 15), (15, 15))] == [
        9.0,
        3.0,
        1.0,
        1.0,
    ]


@pytest.mark.parametrize(("neighbourhood", "steps"), [(1, 6), (2, 3), (3, 2)])
def test_fields_in_space(neighbourhood: int, steps: int) -> None:
    fields = bound((9, 9, 9), (4, 4, 4), neighbourhood=neighbourhood)
    found = fields.grid.inner(fields.steps_to(fields.grid.index_of((1, 1, 1))))
    assert found[3, 3, 3] == steps
    assert fields.grid.inner(fields.unsafeness)[3, 4, 4] == 9.0


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"goal_potentials": (1.0, 1.0)}, "ascending"),
        ({"obstacle_potentials": (1.0, 2.0)}, "descending"),
        ({"neighbourhood": 3}, r"collision\.neighbourhood: must be at most .* \(2\), was 3"),
    ],
)
def test_settings_that_cannot_be_are_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(SettingError, match=said):
        bound((4, 4), **changed)
