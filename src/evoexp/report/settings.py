"""How reports are written; no part of any identity."""

from typing import Annotated, Literal

from pydantic import Field

from evoexp.validation import Count, Settings


class ReportSettings(Settings):
    """Settings of `conf/report`.

    Attributes:
        formats: File formats of every figure.
        dpi: Resolution of raster formats [1/inch].
    """

    formats: Annotated[tuple[Literal["svg", "png", "pdf"], ...], Field(min_length=1)]
    dpi: Count
