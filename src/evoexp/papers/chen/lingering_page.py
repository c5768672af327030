"""Paths that the mean of Eq. 3 of Chen & Zalzala 1995 rewards: they linger in safe places."""

from functools import partial

import numpy as np

from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen import path_page
from evoexp.papers.chen.figures import grid_paths
from evoexp.papers.chen.path_measures import Group
from evoexp.report.kit import Drawing, Page, ReportSettings, Results, generic, markdown

INTRODUCTION = (
    "The unsafeness of a path is the mean over its nodes (Eq. 3): every further step in a safe "
    "place lowers it. Where nodes may be passed again, the best path waits there; the cost of "
    "its length alone ends it. The paper does not say whether nodes may be passed again; "
    "everywhere else loops are erased. For paths with revisits the best walk is exact (dynamic "
    "programming over the number of nodes); without them it is a bound."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of lingering paths, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    groups = measures.group_list(results)
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=path_page.quantities(results, groups),
        checks=(
            *((f"{g.name}: lingering", _lingering(g, groups)) for g in groups if g.revisits),
            *(
                (f"{g.name}: best path known", _best_known(g))
                for g in groups
                if g.truth is not None
            ),
        ),
        drawings=_drawings(groups),
    )


def _lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in measures.paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{markdown.share(int(np.count_nonzero(repeats)), len(repeats))} runs pass nodes "
        f"again, median {np.median(repeats):.0f} repeated nodes; median length "
        f"{_length(group):.0f} cells"
    ) + "".join(f", {_length(g):.0f} without revisits" for g in simple)


def _best_known(group: Group) -> str:
    """Describe the best path that the reference knows."""
    assert group.truth is not None
    (best,) = group.best_path
    length, unsafeness, exact = (
        float(group.truth.column(f"term_{name}")[0])
        for name in ("distance", "unsafeness", "bound_is_reached")
    )
    return (
        f"cost {group.optimum:.4g}: length {length:.4g}, mean unsafeness {unsafeness:.3g}, "
        f"{len(best)} nodes, {_repeated(best)} of them passed before; "
        f"{'exact' if exact else f'no path is below {group.bound:.4g}'}"
    )


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))


def _drawings(groups: tuple[Group, ...]) -> tuple[Drawing, ...]:
    panels = [(group.name, group.main, grid_paths.known_lines(group)) for group in groups]
    return (
        Drawing(
            "paths",
            "Paths with and without revisits",
            "Run of median cost of the genetic algorithm, and the best path known. Lines that go "
            "back and forth lie on each other: the next figure counts nodes.",
            partial(grid_paths.paths_table, panels),
            grid_paths.draw_paths,
            tuple(c for group in groups for c in group.all),
        ),
        Drawing(
            "lingering",
            "How many nodes lie in places of which unsafeness",
            "Nodes of the best solution of every run: mean number per unsafeness of the node, "
            "counted as often as they are passed.",
            partial(grid_paths.places_table, groups),
            grid_paths.draw_places,
            tuple(group.main for group in groups),
        ),
    )
