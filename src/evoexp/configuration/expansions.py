"""The door to `compose` for whoever is imported before it is known whether anything is composed."""

from collections.abc import Sequence

from evoexp.configuration.experiment import Experiment


def expand(
    overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> list[Experiment]:
    """Expand overrides into experiments, as `compose.expand` does.

    Raises:
        EvoexpError: For whatever cannot be run.
    """
    from evoexp.configuration import compose  # and Hydra, which takes a tenth of a second

    return compose.expand(overrides, multirun=multirun, only=only)
