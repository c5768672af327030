"""Pictures of the motions that any planner found: scene, stages, joints, covers."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.playback import player_page
from evoexp.playback.recording import Heading, NoMotion, Recording, record
from evoexp.report.figures import motion_scenes
from evoexp.report.pages.page_parts import Drawing, PlayedRun, Player
from evoexp.report.pages.page_words import WORDS
from evoexp.report.results.stored_results import ConditionResults, Results

JOIN = " · "  # between experiment and condition, as in the titles of `evoexp view`
VERDICTS = {True: "certified", False: "refuted", None: "undecided"}
MOST = 4  # conditions whose motions are shown, those with the least best cost


class ShownMotion(NamedTuple):
    """The best motion of a condition."""

    condition: ConditionResults  # the condition
    recording: Recording  # the motion of its best replicate

    @property
    def title(self) -> str:
        """Label and verdict, as one line."""
        return f"{self.condition.label}: {VERDICTS[self.recording.verdict.certified]}"

    @property
    def run(self) -> PlayedRun:
        """The run, to be played beside a figure."""
        return PlayedRun(self.condition, self.recording.heading.replicate)


def players_of(drawings: Iterable[Drawing], experiment: str) -> dict[tuple[str, int], Player]:
    """Return the players of all motions that figures show, each once, by the keys of the runs.

    The name of the experiment is empty for runs given by their hashes.
    """
    runs = {run.key: run for drawing in drawings for run in drawing.plays}
    players = ((key, _player(experiment, run)) for key, run in runs.items())
    return {key: player for key, player in players if player}


def _player(experiment: str, run: PlayedRun) -> Player | None:
    """Return the player of a run; None if its solution is no motion."""
    c, k = run
    try:
        title = JOIN.join(dict.fromkeys(word for word in (experiment, c.label) if word))
        found = record(c.condition, c.solutions[k], Heading(title, k))
    except NoMotion:
        return None
    words = f"{c.label}, replicate {k}: {VERDICTS[found.verdict.certified]}"
    return Player(words, f"motion_{c.condition.id[:12]}_{k:04d}.html", player_page.page([found]))


def best_motions(results: Results) -> list[ShownMotion]:
    """Return the best motions of the conditions that have one, at most `MOST`, best ones first."""
    found: list[ShownMotion] = []
    for condition in sorted(results.with_data, key=_best_cost):
        if len(found) == MOST:
            break
        replicate = condition.best_replicate
        heading = Heading(condition.label, replicate)
        try:
            motion = record(condition.condition, condition.solutions[replicate], heading)
        except NoMotion:
            continue
        found.append(ShownMotion(condition, motion))
    return sorted(found, key=lambda each: results.with_data.index(each.condition))


def drawings(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figures of motions; none without motions."""
    if not shown:
        return ()
    best = min(shown, key=lambda each: _best_cost(each.condition))
    given = (best.condition,), best.recording
    return (
        *scene_drawing(shown),
        WORDS.drawing("stages", motion_scenes.STAGES, *given, label=best.condition.label),
        WORDS.drawing("joints", motion_scenes.JOINTS, *given),
        *_cover_drawing(shown),
    )


def scene_drawing(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figure of robots and scenes, with the motions to be played; none without any."""
    titled = [(each.title, each.recording) for each in shown]
    conditions, plays = [each.condition for each in shown], [each.run for each in shown]
    found = WORDS.drawing("scene", motion_scenes.SCENES, conditions, titled, plays=plays)
    return (found,) if shown else ()


def notes(shown: Sequence[ShownMotion]) -> tuple[tuple[str, str], ...]:
    """Return (conditions, note): the notes on the conditions whose motions are shown."""
    labels: dict[str, list[str]] = {}
    for each in shown:
        for note in each.condition.condition.notes():
            own = labels.setdefault(note, [])
            if each.condition.label not in own:
                own.append(each.condition.label)
    return tuple((", ".join(own), note) for note, own in labels.items())


def _cover_drawing(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figure of bodies beside covers: one row per robot that has covers."""
    rows: dict[object, tuple[str, Recording, Sequence[Any]]] = {}
    conditions = []
    for each in shown:
        planner, problem = each.condition.prepared
        covers = tuple(planner.covers(problem))
        key = each.condition.condition.robot, len(covers)
        if covers and key not in rows:
            rows[key] = each.condition.label, each.recording, covers
            conditions.append(each.condition)
    found = WORDS.drawing("covers", motion_scenes.COVERS, conditions, list(rows.values()))
    return (found,) if rows else ()


def _best_cost(condition: ConditionResults) -> float:
    cost = float(condition.summaries["best_cost"].astype("float64").min())
    return cost if np.isfinite(cost) else np.inf
