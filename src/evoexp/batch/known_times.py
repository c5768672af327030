"""How long replicates took before, on this machine: short ones need no worker processes.

To start workers takes a second of processor time, a hundred short replicates. Nothing but where a
replicate is run follows from these times.
"""

import contextlib
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from evoexp.batch.jobs import Job, Outcome
from evoexp.numeric.cache_folder import Damaged, cache_root, read_kept, write_kept
from evoexp.store.kept_facts import installed_code

SHORT_S = 0.3  # [s] of all replicates together, below which they are run without workers


def are_short(jobs: Sequence[Job]) -> bool:
    """Return whether jobs are known to take less than `SHORT_S` together."""
    known: dict[bytes, float | None] = {}
    total = 0.0
    for job in jobs:
        text = job.condition_json
        if text not in known:
            known[text] = _read(text)
        seconds = known[text]
        if seconds is None or (total := total + seconds) > SHORT_S:
            return False
    return True


class LongestTimes:
    """The longest time that a replicate of each condition took in a batch [s]."""

    def __init__(self) -> None:
        """Begin without any."""
        self._seconds: dict[str, float] = {}

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Take in replicates that ended; a failed one may have been about to take for ever."""
        for each in outcomes:
            seconds = float("inf") if each.summary is None else each.summary.cpu_s
            self._seconds[each.condition_id] = max(seconds, self._seconds.get(each.condition_id, 0))

    def keep(self, config_jsons: Mapping[str, bytes]) -> None:
        """Keep them for later batches; silent where that cannot be done.

        Args:
            config_jsons: Condition → its canonical form.
        """
        for key, seconds in self._seconds.items():
            with contextlib.suppress(OSError):
                write_kept(_path(config_jsons[key]), json.dumps(seconds).encode())


def _read(config_json: bytes) -> float | None:
    with contextlib.suppress(FileNotFoundError, Damaged, ValueError):
        return float(json.loads(read_kept(_path(config_json))))
    return None


def _path(config_json: bytes) -> Path:
    """Return the file of a condition's time: of the same code, whatever the seed."""
    config = json.loads(config_json) | {"seed": 0}
    digest = hashlib.sha256(installed_code() + json.dumps(config, sort_keys=True).encode())
    return cache_root() / "times" / digest.hexdigest()[:32]
