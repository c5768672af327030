"""The conditions of one experiment: entries of its file crossed with the command line, built once.

An override of the command line wins over an entry. It concerns the conditions that have such a
setting; one that concerns none is refused.

A folder of problems as MoveIt writes them, `scenario.folder=…`, gives a condition per problem: a
`scene0001.yaml` beside a `request0001.yaml`, or folders of these, as MotionBenchMaker has them.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.attachments import located
from evoexp.configuration.assignment import assigned, known_instead
from evoexp.configuration.building import MARK, condition_of
from evoexp.configuration.experiment import Budget, Built
from evoexp.configuration.labels import Crossed, labels_of, refuse_equal_labels, rejoined
from evoexp.configuration.overrides import (
    NOT_IDENTITY,
    PLANNER_PARTS,
    Choice,
    Override,
    Value,
    single_values,
    sweep,
    sweep_texts,
)
from evoexp.configuration.refusals import chosen
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting
from evoexp.shipped import Option

FOLDER, SCENE, REQUEST = "scenario.folder", "scenario.scene", "scenario.request"
MOST_PROBLEMS = 10_000  # conditions of one call

Entry = tuple[str, Choice]  # label and overrides, each with one value, of an experiment's file


class Composed(NamedTuple):
    """Chosen options, composed."""

    config: dict[str, Any]  # their settings as plain data, interpolations as they are written
    options: tuple[Option, ...]  # the option taken of each group


class Builder:
    """Builds the conditions of an experiment at one budget, each choice of overrides once."""

    def __init__(
        self,
        name: str,
        entries: Sequence[Entry],
        composed: Callable[[Choice], Composed],
        budget: Budget,
    ) -> None:
        self.name, self.budget = name, budget
        self._entries, self._composed = entries, composed
        self._known: dict[frozenset[str], Built] = {}

    def build_all(self, overrides: Choice, only: Sequence[str]) -> dict[str, Built]:
        """Build all conditions, each once; return by their labels those of `only`, or all.

        All are built even if some are kept: the labels of one condition make one label.
        """
        rows = list(self._crossed(overrides))
        refuse_equal_labels(rows)
        names = {name for row in rows for name in (row.label, row.entry) if name}
        picked = rejoined(only, names)
        named = [row for row in rows if row.is_named(picked)] or rows
        self._refuse_unused(overrides, named)
        members: dict[str, list[Crossed]] = {}
        for row in rows:
            try:
                members.setdefault(self._built(row.choice).condition.id, []).append(row)
            except EvoexpError:
                if row in named:
                    raise
        groups = [(same, self._built(same[0].choice)) for same in members.values()]
        labels = labels_of(groups)
        picked = rejoined(only, known := {*labels, *names})
        if unknown := [label for label in picked if label not in known]:
            raise UnknownOption("--only", unknown[0], known)
        return {
            label: built
            for label, (same, built) in zip(labels, groups, strict=True)
            if not picked or label in picked or any(row.is_named(picked) for row in same)
        }

    def _built(self, choice: Choice) -> Built:
        key = frozenset(each.word for each in choice.values() if each.root not in NOT_IDENTITY)
        if key not in self._known:
            config, options = self._composed(choice)
            condition, is_capped = condition_of(assigned(config, choice), self.budget)
            self._known[key] = Built(condition, options, is_capped)
        return self._known[key]

    def _crossed(self, overrides: Choice) -> Iterator[Crossed]:
        """Yield the entries with each combination of the values that overrides have."""
        for label, own in self._entries:
            seen = set[frozenset[str]]()
            for combination in sweep(overrides):
                typed = self._concerning(combination, own)
                words = frozenset(each.word for each in typed.values())
                if words in seen:  # the swept setting concerns other conditions
                    continue
                seen.add(words)
                swept = sweep_texts(overrides, typed)
                for problem, choice in _problem_choices({**own, **typed}):
                    yield Crossed(self.name, label, swept, problem, own, typed, choice)

    def _concerning(self, choice: Choice, own: Choice) -> Choice:
        """Return the overrides of the command line that concern a condition."""
        planner = str(self._composed({**own, **choice}).config.get("planner"))
        parts = [key for key in choice if key in PLANNER_PARTS and choice[key].option()]
        not_taken = {key for key in parts if f"{MARK}{key}" not in planner}
        choice = {key: each for key, each in choice.items() if key not in not_taken}
        return concerning(choice, self._composed({**own, **choice}).config)

    def _refuse_unused(self, overrides: Choice, rows: Sequence[Crossed]) -> None:
        """Refuse an override of the command line that concerns none of the conditions."""
        for key, override in overrides.items():
            if any(key in row.typed for row in rows):
                continue
            configs = [self._composed(row.choice).config for row in rows]
            known = {name for each in configs for name in known_instead(each, override) or ()}
            if known:
                raise UnknownSetting(key, sorted(known))
            if override.root != key:
                raise SettingError(override.root, chosen(override.root), None)
            self._built({**rows[0].choice, key: next(single_values(override))})  # says why not


def concerning(choice: Choice, config: dict[str, Any]) -> Choice:
    """Return the overrides that chosen options have a setting for, and those of groups."""
    return {key: each for key, each in choice.items() if known_instead(config, each) is None}


def _problem_choices(choice: Choice) -> Iterator[tuple[str, Choice]]:
    """Yield label and overrides of every problem of a folder; without one, the overrides as given.

    A label is the folder's name and the number, `box_panda 0001`; problems come in the order of the
    paths of their scenes.
    """
    if FOLDER not in choice:
        yield "", choice
        return
    for key in (SCENE, REQUEST):
        if key in choice:
            raise SettingError(key, f"left out beside {FOLDER}", choice[key].text)
    folder = "".join(str(value.data) for value in choice[FOLDER].values)
    root = Path(located(folder))
    if "\0" in folder or not root.is_dir():
        raise SettingError(FOLDER, "a folder of problems", folder)
    scenes = sorted([*root.glob("scene*.yaml"), *root.glob("*/scene*.yaml")])
    if not scenes or len(scenes) > MOST_PROBLEMS:
        must = f"a folder of 1 to {MOST_PROBLEMS:,} problems (scene0001.yaml, request0001.yaml, …)"
        raise SettingError(FOLDER, must, f"{folder} with {len(scenes) or 'none'}")
    rest = {key: override for key, override in choice.items() if key != FOLDER}
    for scene in scenes:
        number = scene.stem.removeprefix("scene")
        request = scene.with_name(f"request{number}.yaml")
        if not request.is_file():
            raise SettingError(FOLDER, f"a folder with {request.name} beside every scene", folder)
        files = {}
        for key, path in ((SCENE, str(scene)), (REQUEST, str(request))):
            files[key] = Override("", key, (Value(path, path),), False, f"{key}={path}")
        yield f"{scene.resolve().parent.name} {number}".strip(), rest | files
