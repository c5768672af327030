"""Pages: which figures, claims and checks a report of some experiment has."""

import importlib
from typing import TYPE_CHECKING, Any, cast

from evoexp.errors import UnknownOption
from evoexp.report.report_settings import ReportSettings

if TYPE_CHECKING:  # pandas: `evoexp run` asks for the names of the pages before anything else
    from evoexp.report.page import Page
    from evoexp.report.results import Results

PAGES = {
    "chen_fields": "evoexp.papers.chen.fields_page:page",
    "chen_lingering": "evoexp.papers.chen.lingering_page:page",
    "chen_mission": "evoexp.papers.chen.mission_page:page",
    "chen_path": "evoexp.papers.chen.path_page:page",
    "chen_landscapes": "evoexp.papers.chen.landscapes_page:page",
    "chen_placement": "evoexp.papers.chen.placement_page:page",
    "corsepius": "evoexp.papers.corsepius.page:page",
    "corsepius_population": "evoexp.papers.corsepius.population_page:page",
    "corsepius_sweep": "evoexp.papers.corsepius.sweep_page:page",
    "curkovic": "evoexp.papers.curkovic.page:page",
    "curkovic_motion": "evoexp.papers.curkovic.motion_page:page",
    "curkovic_pareto": "evoexp.papers.curkovic.pareto_page:page",
    "curkovic_sweep": "evoexp.papers.curkovic.sweep_page:page",
    "ablations": "evoexp.papers.rana.operators_page:page",
    "generic": "evoexp.report.pages.generic:page",
    "lavoie": "evoexp.papers.lavoie.page:page",
    "lavoie_sweep": "evoexp.papers.lavoie.sweep_page:page",
    "planar_arms": "evoexp.report.pages.planar_arms:page",
    "rana": "evoexp.papers.rana.page:page",
}
"""Name, as `report.figures` gives it → `module:function`."""


def page_of(results: "Results", settings: ReportSettings) -> "Page":
    """Return the page that the settings name, filled from results.

    Raises:
        UnknownOption: If there is none of this name.
    """
    name = settings.figures or "generic"
    if name not in PAGES:
        raise UnknownOption("report.figures", name, PAGES)
    module, _, function = PAGES[name].partition(":")
    return cast(
        "Page", cast(Any, getattr(importlib.import_module(module), function))(results, settings)
    )
