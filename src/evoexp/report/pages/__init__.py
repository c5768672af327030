"""Pages: which figures, claims and checks a report of some experiment has."""

import importlib
from typing import TYPE_CHECKING, Any, cast

from evoexp.errors import UnknownOption
from evoexp.report.settings import ReportSettings

if TYPE_CHECKING:  # pandas: `evoexp run` asks for the names of the pages before anything else
    from evoexp.report.page import Page
    from evoexp.report.results import Results

PAGES = {
    "chen_fields": "evoexp.report.pages.chen_fields:page",
    "chen_lingering": "evoexp.report.pages.chen_lingering:page",
    "chen_mission": "evoexp.report.pages.chen_mission:page",
    "chen_path": "evoexp.report.pages.chen_path:page",
    "chen_landscapes": "evoexp.report.pages.chen_landscapes:page",
    "chen_placement": "evoexp.report.pages.chen_placement:page",
    "corsepius": "evoexp.report.pages.corsepius:page",
    "corsepius_population": "evoexp.report.pages.corsepius_population:page",
    "corsepius_sweep": "evoexp.report.pages.corsepius_sweep:page",
    "curkovic": "evoexp.report.pages.curkovic:page",
    "curkovic_motion": "evoexp.report.pages.curkovic_motion:page",
    "curkovic_pareto": "evoexp.report.pages.curkovic_pareto:page",
    "curkovic_sweep": "evoexp.report.pages.curkovic_sweep:page",
    "ablations": "evoexp.report.pages.ablations:page",
    "generic": "evoexp.report.pages.generic:page",
    "lavoie": "evoexp.report.pages.lavoie:page",
    "lavoie_sweep": "evoexp.report.pages.lavoie_sweep:page",
    "planar_arms": "evoexp.report.pages.planar_arms:page",
    "rana": "evoexp.report.pages.rana:page",
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
