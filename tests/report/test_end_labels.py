"""Names of curves at their ends: in order, apart, and a legend where they are few."""

import pytest

from evoexp.report.figures import style
from evoexp.report.figures.end_labels import MANY, name_curves


def names_of(count: int, look: style.Look) -> tuple[list[str], int]:
    """Return the texts beside the axes from above, and the number of legends."""
    seen = []

    def draw() -> object:
        figure, (axes,) = style.panels(3.0)
        for k in range(count):
            axes.plot([0.0, 1.0], [0.5, 0.1 * k], label=f"planner {k}", **style.curve_look(k))
        name_curves(figure, axes, 3)
        seen.append(figure)
        return figure

    style.drawn(draw, ["png"], 50, look)  # type: ignore[arg-type]
    texts = sorted(seen[0].axes[0].texts, key=lambda text: -text.get_position()[1])
    return [text.get_text() for text in texts], len(seen[0].legends)


def test_many_curves_are_named_at_their_ends_from_the_highest_to_the_lowest() -> None:
    names, legends = names_of(MANY, style.Look())
    assert names == [f"planner {k}" for k in reversed(range(MANY))]
    assert legends == 0


@pytest.mark.parametrize(("count", "width"), [(MANY - 1, "page"), (MANY, "column")])
def test_few_curves_and_those_of_a_column_have_a_legend(count: int, width: str) -> None:
    names, legends = names_of(count, style.Look(width))  # type: ignore[arg-type]
    assert names == []
    assert legends == 1
