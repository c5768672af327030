"""One tree of errors: each is one line that a user can act on, and each carries its data.

Every `EvoexpError` reaches the command line as one line on stderr and exit code 2. A programming
error is none of these: it keeps its traceback.
"""

import difflib
import os
import re
import sys
from collections.abc import Iterable, Sequence

_SHOWN = 200  # [-] characters of a value in a message
_LONGEST = 1200  # [-] characters of any other text in it, such as a list of names
_MOST_NAMES = 12  # [-] names that a message lists; of more it lists the nearest
_NEAREST = 5  # [-] names listed then
_FOLDERS = re.compile(r"(?<![\w.:/~-])/(?:[^\s/:'\"]+/)+")  # of an absolute path


class EvoexpError(Exception):
    """Base of everything that evoexp raises on purpose."""


def printable(text: str) -> str:
    """Return a text in which nothing steers a terminal: control characters are spelt out.

    Names and reasons may come from somebody else's log. Ends of lines stay.
    """
    if text.replace("\n", "").isprintable():
        return text
    return "".join(
        sign if sign.isprintable() or sign == "\n" else sign.encode("unicode_escape").decode()
        for sign in text
    )


def portable(text: str) -> str:
    """Return a text without the folders of this machine: `evoexp/cli.py`, `scene.yaml`."""
    for folder in sorted(filter(os.path.isabs, sys.path), key=len, reverse=True):
        text = text.replace(f"{folder}/", "")
    return _FOLDERS.sub("", text)


def brief(text: str, most: int = _LONGEST) -> str:
    """Return a text of at most so many characters, one of them an ellipsis where it was longer."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


def nearest(name: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` for the closest known name, an empty string if none is close."""
    matches = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{brief(matches[0], _SHOWN)}'?" if matches else ""


def _choices(heading: str, known: Sequence[str], name: str) -> str:
    """Name the known name nearest to one, and all where they are few, else some near ones."""
    listed = ", ".join(known) or "none"
    if len(known) > _MOST_NAMES:
        near = difflib.get_close_matches(name, known, n=_NEAREST, cutoff=0.0)
        listed = f"{', '.join(near)}, … {len(known)} in all"
    return f"{nearest(name, known)} ({heading}: {listed})"


class SettingError(EvoexpError):
    """A setting that is refused: the field, the values it may have, the value given, a near name.

    The field is a dotted path, as one would type it (`ga.population_size`); `must` is read after
    "must be".
    """

    def __init__(self, field: str, must: str, was: object, hint: str = "") -> None:
        super().__init__(f"{field}: must be {brief(must)}, was {brief(repr(was), _SHOWN)}{hint}")
        self.field, self.must, self.was, self.hint = field, must, was, hint


def demand(holds: object, field: str, must: str, was: object, hint: str = "") -> None:
    """Refuse a setting by a `SettingError`, unless a condition holds."""
    if not holds:
        raise SettingError(field, must, was, hint)


def demand_known(name: str, known: Iterable[str], field: str, must: str) -> None:
    """Refuse a name that is not known by a `SettingError` that tells the nearest."""
    if name not in known:
        raise SettingError(field, must, name, nearest(name, known))


class UnknownSetting(EvoexpError):
    """A key that no component has; names the nearest, and lists them where they are few."""

    def __init__(self, field: str, known: Iterable[str]) -> None:
        self.field, self.known = field, sorted(known)
        choices = _choices("known here", self.known, field.rsplit(".", 1)[-1])
        super().__init__(f"{field}: unknown setting{choices}")


class UnknownOption(EvoexpError):
    """A name that is no option of its kind (experiment, robot, planner, …); names the nearest."""

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind, self.name, self.known = kind, name, sorted(known)
        super().__init__(f"{kind}: no option '{name}'{_choices('options', self.known, name)}")


class RegistrationError(EvoexpError):
    """An installed package that registers a name wrongly; the message names the package."""


class MissingDistribution(EvoexpError):
    """Stored results need packages (`my-planner 0.3`) that are not installed."""

    def __init__(self, log: str, packages: Iterable[str]) -> None:
        self.packages = sorted(packages)
        verb = "is" if len(self.packages) == 1 else "are"
        names = " and ".join(self.packages)
        super().__init__(f"{log}: needs {names}, which {verb} not installed")


class UnknownHash(EvoexpError):
    """A hash prefix that names no run here and no shipped condition, or a text that is no hash."""


class AmbiguousHash(EvoexpError):
    """A hash prefix that several runs share; lists the candidates."""

    def __init__(self, prefix: str, candidates: Iterable[str]) -> None:
        self.candidates = sorted(candidates)
        super().__init__(f"hash: '{prefix}' is ambiguous: {', '.join(self.candidates)}")


class CorruptLog(EvoexpError):
    """A log that is cut or altered, or that evoexp did not write."""


class OtherVersion(CorruptLog):
    """A log that another version of evoexp wrote: unreadable here, and perhaps whole."""


class StoreError(EvoexpError):
    """A run directory that is damaged, or that belongs to another condition."""


class Notice(UserWarning):
    """One line for the user of a command, which goes on; it is printed on stderr as it is."""


class DamagedStore(Notice):
    """A stored file is damaged: it is left out, taken from elsewhere, or set aside."""


class Busy(EvoexpError):
    """Another process writes the same run now."""


class RevisionMismatch(EvoexpError):
    """A stored run was made by another revision of a component than the one installed."""


class MotionFileError(EvoexpError):
    """A motion file that cannot be read as the planner's documented shape."""


class NothingStored(EvoexpError):
    """The outputs hold no finished replicate of the requested runs."""
