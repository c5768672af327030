"""Players of motions: pages that stand beside the figures that show the same motions."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from evoexp.playback import player_page
from evoexp.playback.recording import Heading, NoMotion, record
from evoexp.report.page_parts import Drawing, PlayedRun
from evoexp.report.page_text import MotionText

JOIN = " · "  # between experiment and condition, as in the titles of `evoexp view`


class Player(NamedTuple):
    """A page that plays a motion in any browser, offline; `evoexp view` writes the same."""

    text: MotionText  # its title and its file
    content: bytes  # HTML


Key = tuple[str, int]  # full hash of a condition, replicate
Players = Mapping[Key, Player]


def key(run: PlayedRun) -> Key:
    """Return the key of a run: its condition and its replicate."""
    return run.condition.condition.id, run.replicate


def players_of(drawings: Iterable[Drawing], experiment: str) -> dict[Key, Player]:
    """Return the players of all motions that figures show, each once.

    Args:
        drawings: The figures.
        experiment: Name of the experiment; empty for runs given by their hashes.
    """
    runs = {key(run): run for drawing in drawings for run in drawing.plays}
    players = ((name, _player(experiment, run)) for name, run in runs.items())
    return {name: player for name, player in players if player}


def _player(experiment: str, run: PlayedRun) -> Player | None:
    """Return the player of a run; None if its solution is no motion."""
    c, k = run
    try:
        title = JOIN.join(dict.fromkeys(word for word in (experiment, c.label) if word))
        found = record(c.condition, c.solutions[k], Heading(title, k))
    except NoMotion:
        return None
    verdict = {True: "certified", False: "refuted", None: "undecided"}[found.verdict.certified]
    text = MotionText(
        f"{c.label}, replicate {k}: {verdict}", f"motion_{c.condition.id[:12]}_{k:04d}.html"
    )
    return Player(text, player_page.page([found]))
