"""Recordings of stored replicates: the condition attached to a log, and the best solution in it."""

from pathlib import Path

from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition
from evoexp.playback.recording import Heading, Recording, record
from evoexp.playback.timing import SpeedLimits
from evoexp.store.log_reader import read_log


def stored_recording(log: Path, title: str = "", limits: SpeedLimits | None = None) -> Recording:
    """Return the motion of a log's best solution; the log alone is enough.

    Args:
        log: Path of a finished log.
        title: Title of the recording; by default the hash of the condition.
        limits: Speed limits of the joints.

    Raises:
        CorruptLog: The log cannot be trusted.
        RevisionMismatch: It was made by another revision of a component.
        NoMotion: Its solution is no motion.
    """
    contents = read_log(log)
    keep_all(data for name, data in contents.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(contents.config_json)
    improvements = tuple((row.generation, row.cost) for row in contents.solutions)
    heading = Heading(title or contents.condition_id[:12], contents.replicate, improvements)
    found = record(condition, contents.solutions[-1].values, heading, limits)
    return found._replace(condition_id=contents.condition_id, config_json=contents.config_json)
