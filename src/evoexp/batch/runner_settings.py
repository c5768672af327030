"""How a batch is run; no part of any identity."""

from evoexp.validation import Count, Settings


class RunnerSettings(Settings):
    """Settings of `conf/runner`.

    Attributes:
        num_workers: Worker processes; None: as many as there are cores.
    """

    num_workers: Count | None
