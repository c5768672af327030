"""Settings of reports; they are no part of any identity."""

from typing import Annotated, Literal

from pydantic import Field

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
