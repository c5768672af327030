"""How a batch is run; no part of any identity."""

from typing import Annotated, Literal

from pydantic import Field

from evoexp.validation import Positive, Settings

MOST_WORKERS = 1000  # processes that one machine starts


class RunnerSettings(Settings):
    """Settings of `conf/runner`."""

    # worker processes; None: as many as there are cores
    num_workers: Annotated[int, Field(ge=1, le=MOST_WORKERS)] | None
    # memory that one replicate may take, by its planner's estimate; what would take more is
    # refused before it begins, and what does take more in a worker fails [GB]. None: the
    # machine's, divided by the workers
    memory_gb: Positive | None = None
    # wall time that one replicate may take [s]; one that takes longer is run once more, then
    # it has failed. None: any time
    timeout_s: Positive | None = None
    # loky: processes of this machine (once started by it) | dask: of `distributed`
    backend: Literal["loky", "dask"] = "loky"
    # of a scheduler of `distributed` that runs already; None: one is started here, with
    # `num_workers` workers
    address: str | None = None
