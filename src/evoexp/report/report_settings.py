"""Settings of reports; they are no part of any identity."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from evoexp.errors import SettingError, UnknownOption
from evoexp.registry import PAGES, Registration, names, registered
from evoexp.validation import Count, Positive, Settings

GENERIC = "generic"  # page of an experiment that names none

Share = Annotated[float, Field(gt=0.0, lt=1.0)]


class ReportSettings(Settings):
    """Settings of `conf/report`."""

    # file formats of every figure
    formats: Annotated[tuple[Literal["svg", "png", "pdf"], ...], Field(min_length=1)]
    dpi: Count  # resolution of raster formats [1/inch]
    confidence: Share  # level of every interval
    significance: Share  # below this adjusted p-value a difference counts in a verdict
    num_resamples: Count  # of every bootstrap interval
    # configurations per segment of a path at which figures measure distances
    samples_per_segment: Count
    # cost that "effort to a threshold" means, in units of the scene's lower bound
    threshold_ratio: Positive
    # name of the page that draws the experiment; None: conditions, convergence and parameters
    # only
    figures: str | None
    # of figures: over the whole page (7.2 inch at most), or over one of two columns (3.5)
    width: Literal["page", "column"] = "page"
    # path of a matplotlib style file that is applied over evoexp's own style
    style: str | None = None

    @model_validator(mode="after")
    def _style_is_a_file(self) -> Self:
        if self.style is not None and not Path(self.style).is_file():
            raise SettingError("style", "the path of a matplotlib style file", self.style)
        return self


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
