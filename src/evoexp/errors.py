"""One tree of errors: each is one line that a user can act on, and each carries its data.

Every `EvoexpError` reaches the command line as one line on stderr and exit code 2. A programming
error is none of these: it keeps its traceback.
"""

import difflib
from collections.abc import Iterable


class EvoexpError(Exception):
    """Base of everything that evoexp raises on purpose."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` for the closest known name.

    Or an empty string where none is close.
    """
    matches = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{matches[0]}'?" if matches else ""


class SettingError(EvoexpError):
    """A setting that cannot be: names the field, what it must be, what it was.

    And the nearest valid name.

    Attributes:
        field: Dotted path of the setting, as one would type it (`ga.population_size`).
        must: What the setting must be.
        was: The value given, as text.
        hint: What was perhaps meant.
    """

    def __init__(self, field: str, must: str, was: object, hint: str = "") -> None:
        super().__init__(f"{field}: must be {must}, was {was!r}{hint}")
        self.field = field
        self.must = must
        self.was = was
        self.hint = hint


class UnknownSetting(EvoexpError):
    """A key that no component has; lists the valid ones and names the nearest."""

    def __init__(self, field: str, known: Iterable[str]) -> None:
        self.field = field
        self.known = sorted(known)
        last = field.rsplit(".", 1)[-1]
        super().__init__(
            f"{field}: unknown setting{nearest(last, self.known)} (known here: "
            f"{', '.join(self.known) or 'none'})"
        )


class UnknownOption(EvoexpError):
    """A name that is not among the options of its kind (experiment, robot, planner, …).

    Lists them.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.known = sorted(known)
        super().__init__(
            f"{kind}: no option '{name}'{nearest(name, self.known)} (options: "
            f"{', '.join(self.known) or 'none'})"
        )


class UnknownHash(EvoexpError):
    """A hash prefix that names no run here and no shipped condition, or a text that is no hash."""


class AmbiguousHash(EvoexpError):
    """A hash prefix that several runs share; lists the candidates."""

    def __init__(self, prefix: str, candidates: Iterable[str]) -> None:
        self.candidates = sorted(candidates)
        super().__init__(f"hash: '{prefix}' is ambiguous: {', '.join(self.candidates)}")


class CorruptLog(EvoexpError):
    """A log that is cut, altered, or not one of evoexp's."""


class Busy(EvoexpError):
    """Another process writes the same run now."""


class RevisionMismatch(EvoexpError):
    """A stored run was made by another revision of a component than the one installed."""


class MotionFileError(EvoexpError):
    """A motion file that cannot be read as the planner's documented shape."""


class NothingStored(EvoexpError):
    """The outputs hold no finished replicate of what was asked for."""
