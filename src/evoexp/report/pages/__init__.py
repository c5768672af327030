"""Pages: the figures, claims and checks that the report of an experiment has.

Packages register pages in the entry-point group `evoexp.pages`, as `package:page.yaml` (see
`page_file`) or as `module:function`; the option `report.figures` names one of them.
"""

from evoexp.errors import UnknownOption
from evoexp.registry import PAGES, Registration, names, registered
from evoexp.report.report_settings import ReportSettings

GENERIC = "generic"  # page of an experiment that names none


def page_registration(settings: ReportSettings) -> Registration:
    """Return the registration of the page that the settings name; nothing is imported.

    Raises:
        UnknownOption: If there is none of this name.
        RegistrationError: If its package registered it wrongly.
    """
    name = settings.figures or GENERIC
    registration = registered(PAGES, name)
    if registration is None:
        raise UnknownOption("report.figures", name, names(PAGES))
    return registration
