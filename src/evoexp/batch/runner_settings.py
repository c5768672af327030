"""How a batch is run; no part of any identity."""

from typing import Annotated, Literal

from pydantic import Field

from evoexp.validation import Positive, Settings

MOST_WORKERS = 1000  # processes that one machine starts


class RunnerSettings(Settings):
    """Settings of `conf/runner`.

    Attributes:
        num_workers: Worker processes; None: as many as there are cores.
        memory_gb: Memory that one replicate may take, by its planner's estimate; what would take
            more is refused before it begins, and what does take more in a worker fails [GB]. None:
            the machine's, divided by the workers.
        backend: loky: processes of this machine (once started by it) | dask: of `distributed`.
        address: Of a scheduler of `distributed` that runs already; None: one is started here, with
            `num_workers` workers.
        timeout_s: Wall time that one replicate may take [s]; one that takes longer is run once
            more, then it has failed. None: any time.
    """

    num_workers: Annotated[int, Field(ge=1, le=MOST_WORKERS)] | None
    memory_gb: Positive | None = None
    timeout_s: Positive | None = None
    backend: Literal["loky", "dask"] = "loky"
    address: str | None = None
