"""A condition as its canonical form; built when something asks for more than its identity.

Building a condition loads the code of its components, and with them numba and Pinocchio, which
takes most of a second. Commands that only name conditions, or compare them with stored runs, need
none of it.
"""

import functools
import hashlib
import json
from typing import Any

from evoexp.attachments import attached
from evoexp.condition import PARTS, Condition


class KeptCondition:
    """Stands for a `Condition` that was built, checked and kept before by the same code.

    Whatever else is asked of it is asked of the condition, which is built then.
    """

    def __init__(self, text: bytes, is_reference: bool) -> None:
        """Keep the canonical form.

        Args:
            text: Canonical form of the condition.
            is_reference: As of the condition.
        """
        self._text, self.is_reference = text, is_reference

    def to_json(self) -> bytes:
        """Return the canonical form."""
        return self._text

    @functools.cached_property
    def id(self) -> str:
        """As of the condition."""
        return hashlib.sha256(self._text).hexdigest()

    def files(self) -> dict[str, bytes]:
        """Return the contents of the files that it refers to, by their names in a log."""
        config = json.loads(self._text)
        return attached({part: config[part] for part in PARTS})

    def num_replicates(self, asked: int) -> int:
        """Return the number of replicates of this condition: one of a reference, else as asked."""
        return 1 if self.is_reference else asked

    @functools.cached_property
    def _built(self) -> Condition:
        return Condition.from_json(self._text)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)  # of copying and pickling, which look before there is a text
        return getattr(self._built, name)

    def __iter__(self) -> Any:
        return iter(self._built)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, KeptCondition):
            return self._text == other._text
        return isinstance(other, Condition) and self._built == other

    def __hash__(self) -> int:
        return hash(self._built)
