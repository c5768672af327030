"""Settings of reports; they are no part of any identity."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from evoexp.errors import SettingError
from evoexp.validation import Count, Positive, Settings

Share = Annotated[float, Field(gt=0.0, lt=1.0)]


class ReportSettings(Settings):
    """Settings of `conf/report`.

    Attributes:
        formats: File formats of every figure.
        dpi: Resolution of raster formats [1/inch].
        confidence: Level of every interval.
        significance: Below this adjusted p-value a difference counts in a verdict.
        num_resamples: Of every bootstrap interval.
        samples_per_segment: Configurations per segment of a path at which figures measure
            distances.
        threshold_ratio: Cost that "effort to a threshold" means, in units of the scene's lower
            bound.
        width: Of figures: over the whole page (7.2 inch at most), or over one of two columns (3.5).
        style: Path of a matplotlib style file that is applied over evoexp's own style.
        figures: Name of the page that draws the experiment; None: conditions, convergence and
            parameters only.
    """

    formats: Annotated[tuple[Literal["svg", "png", "pdf"], ...], Field(min_length=1)]
    dpi: Count
    confidence: Share
    significance: Share
    num_resamples: Count
    samples_per_segment: Count
    threshold_ratio: Positive
    figures: str | None
    width: Literal["page", "column"] = "page"
    style: str | None = None

    @model_validator(mode="after")
    def _style_is_a_file(self) -> Self:
        if self.style is not None and not Path(self.style).is_file():
            raise SettingError("style", "the path of a matplotlib style file", self.style)
        return self
