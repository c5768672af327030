"""Figures whose axes keep their ticks are those that matplotlib draws without, to the byte."""

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from evoexp.report import kept_ticks, style
from evoexp.report.style import drawn, few_ticks, figure, legend_of_all, log_axis, row_of_panels

X = np.linspace(0.0, 1.0, 50)


def panels() -> Figure:
    found, (left, right) = row_of_panels(2.4, 2, sharey=True)
    left.plot(X, 1e5 * X**2, label="square")
    left.set(title="left", ylabel="cost [-]", xlabel="x [m]")
    left.xaxis.set_major_locator(few_ticks())
    right.plot(X, 1e3 + X, label="line")
    right.tick_params(axis="x", labelrotation=60)
    legend_of_all(found, (left, right), 2)
    return found


def logarithms() -> Figure:
    found = figure(2.2)
    axes = found.add_subplot()
    axes.plot(1.0 + 100.0 * X, 1.0 + X)
    log_axis(axes, 1.0, 100.0)
    other = axes.twinx()
    other.semilogy(1.0 + 100.0 * X, 10.0 ** (9.0 * X))
    axes.xaxis.tick_top()
    axes.set_title("ticks above")
    return found


def plane() -> Figure:
    found, lines = style.lines_of_panels(2.0, 3, 2, 0.2)
    for k, axes in enumerate(lines):
        axes.plot(np.cos(X), 1e-7 * np.sin((1 + k) * X))
        axes.set_aspect("equal", adjustable=("datalim", "box")[k % 2])
        axes.set(xlabel="x", ylabel="y")
    found.align_ylabels()
    found.colorbar(lines[0].scatter(X, X, c=X), ax=lines[1])
    return found


def space() -> Figure:
    found = figure(3.0)
    found.add_subplot(1, 2, 1, projection="3d").plot(X, X, X)  # type: ignore[arg-type]
    found.add_subplot(1, 2, 2, projection="polar").plot(X, X)
    return found


@pytest.mark.parametrize("draw", [panels, logarithms, plane, space])
def test_pictures_are_the_same(draw: Callable[[], Figure], monkeypatch: pytest.MonkeyPatch) -> None:
    kept = drawn(draw, ("svg", "png"), 110)
    monkeypatch.setattr(style, "keep_ticks", lambda figure: None)
    assert kept == drawn(draw, ("svg", "png"), 110)


def test_ticks_are_worked_out_once_per_place(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []
    find = Axis._update_ticks  # type: ignore[attr-defined]
    monkeypatch.setattr(
        Axis, "_update_ticks", lambda axis: (asked.append(True), find(axis))[1], raising=True
    )
    drawn(panels, ("svg", "png"), 110)
    with_memory = len(asked)
    monkeypatch.setattr(style, "keep_ticks", lambda figure: None)
    drawn(panels, ("svg", "png"), 110)
    assert 0 < 2 * with_memory < len(asked) - with_memory


def test_a_moved_axis_looks_for_its_ticks_again() -> None:
    found = Figure()
    axes = found.add_subplot()
    axes.set(xlim=(0.0, 1.0))
    kept_ticks.keep_ticks(found)
    before = [tick.get_loc() for tick in axes.xaxis._update_ticks()]  # type: ignore[attr-defined]
    axes.set(xlim=(0.0, 1000.0))
    after = [tick.get_loc() for tick in axes.xaxis._update_ticks()]  # type: ignore[attr-defined]
    assert max(before) <= 1.0 < max(after)


def test_another_matplotlib_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_ticks, "_ASKED", ("_no_such_name",))
    found = Figure()
    axes = found.add_subplot()
    kept_ticks.keep_ticks(found)
    assert "_update_ticks" not in vars(axes.xaxis)
