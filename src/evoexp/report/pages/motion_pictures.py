"""Pictures of the motions that any planner found: scene, stages, joints, covers."""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.playback import player_page
from evoexp.playback.recording import Heading, NoMotion, Recording, record
from evoexp.report.pages.page_parts import Drawing, PlayedRun, Player
from evoexp.report.results.stored_results import ConditionResults, Results

JOIN = " · "  # between experiment and condition, as in the titles of `evoexp view`
VERDICTS = {True: "certified", False: "refuted", None: "undecided"}
MOST = 4  # conditions whose motions are shown, those with the least best cost


class ShownMotion(NamedTuple):
    """The best motion of a condition."""

    condition: ConditionResults  # the condition
    recording: Recording  # the motion of its best replicate


def players_of(drawings: Iterable[Drawing], experiment: str) -> dict[tuple[str, int], Player]:
    """Return the players of all motions that figures show, each once, by the keys of the runs."""
    players = dict[tuple[str, int], Player]()
    for c, k in {run.key: run for drawing in drawings for run in drawing.plays}.values():
        title = JOIN.join(dict.fromkeys(word for word in (experiment, c.label) if word))
        if motion := _recorded(c, k, title):
            words = f"{c.label}, replicate {k}: {VERDICTS[motion.verdict.certified]}"
            file = f"motion_{c.hash12}_{k:04d}.html"
            players[c.condition.id, k] = Player(words, file, player_page.page([motion]))
    return players


def _recorded(c: ConditionResults, replicate: int, title: str) -> Recording | None:
    """Return the motion of a replicate; None if its solution is none."""
    try:
        return record(c.condition, c.solutions[replicate], Heading(title, replicate))
    except NoMotion:
        return None


def best_motions(results: Results) -> list[ShownMotion]:
    """Return the motions of the conditions with the least costs that have one, at most `MOST`."""
    motions = (
        (c, _recorded(c, c.best_replicate, c.label))
        for c in sorted(results.with_data, key=_best_cost)
    )
    shown = itertools.islice((ShownMotion(c, own) for c, own in motions if own), MOST)
    return sorted(shown, key=lambda each: results.with_data.index(each.condition))


def motions(best_motions: Sequence[ShownMotion]) -> dict[str, Sequence[Any]]:
    """Return the values that figures of motions show, by name.

    `best` is the motion of the least cost alone, `covered` are those with the covers of their
    bodies, one per robot that has any.
    """
    covered: dict[object, tuple[ShownMotion, Sequence[Any]]] = {}
    for each in best_motions:
        planner, problem = each.condition.prepared
        if covers := tuple(planner.covers(problem)):
            key = each.condition.robot, len(covers)
            covered.setdefault(key, (each, covers))
    best = sorted(best_motions, key=lambda each: _best_cost(each.condition))[:1]
    return {
        "titled": [
            (f"{c.label}: {VERDICTS[recording.verdict.certified]}", recording)
            for c, recording in best_motions
        ],
        "conditions": [each.condition for each in best_motions],
        "runs": [PlayedRun(c, own.heading.replicate) for c, own in best_motions],
        "best": [each.recording for each in best],
        "best_condition": [each.condition for each in best],
        "covered": [(own.condition.label, own.recording, rows) for own, rows in covered.values()],
        "covered_conditions": [own.condition for own, _ in covered.values()],
    }


def notes(best_motions: Sequence[ShownMotion]) -> tuple[tuple[str, str], ...]:
    """Return (conditions, note): the notes on the conditions whose motions are shown."""
    labels: dict[str, list[str]] = {}
    for each in best_motions:
        for note in each.condition.condition.notes():
            own = labels.setdefault(note, [])
            if each.condition.label not in own:
                own.append(each.condition.label)
    return tuple((", ".join(own), note) for note, own in labels.items())


def _best_cost(condition: ConditionResults) -> float:
    cost = float(condition.summaries["best_cost"].astype("float64").min())
    return cost if np.isfinite(cost) else np.inf
