"""Pages: the figures, claims and checks that the report of an experiment has.

Packages register pages in the entry-point group `evoexp.pages`, as `package:page.yaml` (see
`page_file`) or as `module:function`; the option `report.figures` names one of them.
"""

from typing import TYPE_CHECKING, cast

from evoexp.errors import UnknownOption
from evoexp.registry import PAGES, Registration, names, registered
from evoexp.report.report_settings import ReportSettings

if TYPE_CHECKING:  # pandas: `evoexp run` asks for the names of the pages before anything else
    from evoexp.report.pages.page_parts import Page
    from evoexp.report.results.stored_results import Results

GENERIC = "generic"  # page of an experiment that names none


def page_registration(settings: ReportSettings) -> Registration:
    """Return the registration of the page that the settings name; nothing is imported.

    Raises:
        UnknownOption: If there is none of this name.
        RegistrationError: If its package registered it wrongly.
    """
    name = settings.figures or GENERIC
    found = registered(PAGES, name)
    if found is None:
        raise UnknownOption("report.figures", name, names(PAGES))
    return found


def page_of(results: "Results", settings: ReportSettings) -> "Page":
    """Return the page that the settings name, filled from results; a sweep has a page of its own.

    A page that shows no motion is given the figure of the scene, with the best motions; claims on
    conditions that were left out are named as not judged.

    Raises:
        UnknownOption: If there is none of this name.
        RegistrationError: If its package registered it wrongly.
    """
    from evoexp.report.pages import swept
    from evoexp.report.pages.page_builder import scene_drawing
    from evoexp.report.results.swept_settings import sweep_of
    from evoexp.report.statistics.judging import left_out

    chosen = page_registration(settings)
    if sweep := sweep_of(results):
        return swept.page(results, sweep, settings)
    page = _built(chosen, results, settings)
    page = page._replace(claims=(*page.claims, *left_out(results, page.claims)))
    if any(drawing.plays for drawing in page.drawings):
        return page
    return page._replace(drawings=(*page.drawings, *scene_drawing(results, settings)))


def _built(chosen: Registration, results: "Results", settings: ReportSettings) -> "Page":
    """Return a page, which is an entry of a file or what a function returns."""
    from evoexp.report.pages.page_builder import build
    from evoexp.report.pages.page_file import read_page_file

    if chosen.target.endswith(".yaml"):
        package, _, file = chosen.target.partition(":")
        return build(read_page_file(package, file), chosen.name, results, settings)
    return cast("Page", chosen.load()(results, settings))
