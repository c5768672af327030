"""The conditions of one experiment: entries of its file crossed with the command line.

An override of the command line wins over an entry. It concerns the conditions that have such a
setting; one that concerns none is refused.

Every condition has a label, and it is true of the condition. Where the command line overrides a
setting in which an experiment's conditions differ, the file's label alone would be false, and
several labels may be of one condition. Such a condition is named by the overriding setting, behind
the parts that the labels have in common.

A folder of problems as MoveIt writes them, `scenario.folder=…`, gives a condition per problem: a
`scene0001.yaml` beside a `request0001.yaml`, or folders of these, as MotionBenchMaker has them.
"""

from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.attachments import located
from evoexp.configuration import overrides as syntax
from evoexp.configuration.building import MARK, condition_of
from evoexp.configuration.experiment import Budget, Built
from evoexp.configuration.overrides import DELETE, Choice, Override, known_instead, single_values
from evoexp.configuration.search_path import chosen
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting, demand
from evoexp.shipped import Option

SAME = " ≡ "  # between labels of one condition
PLANNER = ("planner", *syntax.AROUND)  # groups whose option makes any label of a planner false
FOLDER, SCENE, REQUEST = "scenario.folder", "scenario.scene", "scenario.request"
MOST_PROBLEMS = 10_000  # conditions of one call

Entry = tuple[str, Choice]  # label and overrides, each with one value, of an experiment's file


class Crossed(NamedTuple):
    """An entry of an experiment's conditions with one value of each override."""

    label: str  # by what the entry, the sweep, and a folder of problems say
    entry: str  # label in the experiment's file; empty if the file labels no conditions
    swept: frozenset[str]  # keys of the overrides that the command line sweeps over
    own: Choice  # overrides of the entry, each with one value
    typed: Choice  # overrides of the command line that concern the condition, each with one value
    choice: Choice  # all overrides of the condition, each with one value

    def is_named(self, labels: Iterable[str]) -> bool:
        """Whether one of some labels is the entry's or this combination's."""
        return not {self.entry, self.label}.isdisjoint(labels)


Group = tuple[Sequence[Crossed], Built]  # all combinations, in order, that are one condition


class Composed(NamedTuple):
    """Chosen options, composed."""

    config: dict[str, Any]  # their settings as plain data, interpolations as they are written
    options: tuple[Option, ...]  # the option taken of each group


class Builder(NamedTuple):
    """Builds the conditions of an experiment at one budget."""

    name: str  # of the experiment: the label where nothing else tells conditions apart
    entries: Sequence[Entry]
    composed: Callable[[Choice], Composed]
    budget: Budget

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
        same: dict[str, tuple[list[Crossed], Built]] = {}  # by the condition's identity
        for row in rows:
            try:
                built = self._built(row.choice)
            except EvoexpError:
                if row in named:
                    raise
                continue
            same.setdefault(built.condition.id, ([], built))[0].append(row)
        groups = list(same.values())
        labels = labels_of(groups)
        picked = rejoined(only, known := {*labels, *names})
        if unknown := [label for label in picked if label not in known]:
            raise UnknownOption("--only", unknown[0], known)
        return {
            label: built
            for label, (members, built) in zip(labels, groups, strict=True)
            if not picked or label in picked or any(row.is_named(picked) for row in members)
        }

    def _built(self, choice: Choice) -> Built:
        config, options = self.composed(choice)
        condition, is_capped = condition_of(syntax.assigned(config, choice), self.budget)
        return Built(condition, options, is_capped)

    def _crossed(self, overrides: Choice) -> Iterator[Crossed]:
        for entry, own in self.entries:
            every = (self._concerning(combination, own) for combination in syntax.sweep(overrides))
            # several are equal where a swept setting concerns other conditions
            different = {frozenset(each.word for each in typed.values()): typed for typed in every}
            for typed in different.values():
                swept = syntax.sweep_texts(overrides, typed)
                for problem, choice in _problem_choices({**own, **typed}):
                    label = _joined(entry, *swept.values(), problem) or self.name
                    yield Crossed(label, entry, frozenset(swept), own, typed, choice)

    def _concerning(self, choice: Choice, own: Choice) -> Choice:
        planner = str(self.composed({**own, **choice}).config.get("planner"))
        parts = [key for key in choice if key in syntax.PLANNER_PARTS and choice[key].option()]
        not_taken = {key for key in parts if f"{MARK}{key}" not in planner}
        choice = {key: each for key, each in choice.items() if key not in not_taken}
        return concerning(choice, self.composed({**own, **choice}).config)

    def _refuse_unused(self, overrides: Choice, rows: Sequence[Crossed]) -> None:
        for key, override in overrides.items():
            if any(key in row.typed for row in rows):
                continue
            configs = [self.composed(row.choice).config for row in rows]
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
    demand("\0" not in folder and root.is_dir(), FOLDER, "a folder of problems", folder)
    scenes = sorted([*root.glob("scene*.yaml"), *root.glob("*/scene*.yaml")])
    must = f"a folder of 1 to {MOST_PROBLEMS:,} problems (scene0001.yaml, request0001.yaml, …)"
    was = f"{folder} with {len(scenes) or 'none'}"
    demand(0 < len(scenes) <= MOST_PROBLEMS, FOLDER, must, was)
    rest = {key: override for key, override in choice.items() if key != FOLDER}
    for scene in scenes:
        number = scene.stem.removeprefix("scene")
        request = scene.with_name(f"request{number}.yaml")
        must = f"a folder with {request.name} beside every scene"
        demand(request.is_file(), FOLDER, must, folder)
        files = {}
        for key, path in ((SCENE, str(scene)), (REQUEST, str(request))):
            files[key] = Override("", key, (syntax.Value(path, path),), False, f"{key}={path}")
        yield f"{scene.resolve().parent.name} {number}".strip(), rest | files


# labels


def refuse_equal_labels(rows: Iterable[Crossed]) -> None:
    """Refuse labels that occur twice, or cannot be printed."""
    labels = set[str]()
    for row in rows:
        demand(row.label.isprintable(), "conditions", "labels of printable characters", row.label)
        demand(row.label not in labels, "conditions", "labels that differ", row.label)
        labels.add(row.label)


def rejoined(parts: Sequence[str], labels: Container[str]) -> list[str]:
    """Join the parts of labels that were split at commas of theirs; the longest label wins."""
    joined, start = list[str](), 0
    while start < len(parts):
        ends = range(len(parts), start, -1)
        end = next((k for k in ends if ", ".join(parts[start:k]) in labels), start + 1)
        joined.append(", ".join(parts[start:end]))
        start = end
    return joined


def labels_of(groups: Sequence[Group]) -> list[str]:
    """Return the label of each condition, no two of which are equal."""
    # keys in which the entries of the experiment's file differ
    rows = [member for members, _ in groups for member in members]
    keys = {key for row in rows for key in row.own}
    words = {key: {row.own[key].word if key in row.own else None for row in rows} for key in keys}
    varied = {key for key in keys if len(words[key]) > 1}
    overridden = [varied.intersection(*(m.typed for m in members)) for members, _ in groups]
    labels = [_label(*group, keys) for group, keys in zip(groups, overridden, strict=True)]
    if len(set(labels)) < len(labels):  # whole labels differ
        for k, (members, _) in enumerate(groups):
            labels[k] = SAME.join(_joined(m.label, *_values(m, overridden[k])) for m in members)
    return labels


def _label(members: Sequence[Crossed], built: Built, overridden: set[str]) -> str:
    """Return the label of a condition, of whose entries the command line overrides some keys."""
    labels = list(dict.fromkeys(member.label for member in members))
    if built.is_capped and not (overridden or any(member.swept for member in members)):
        return labels[0]  # others differ from it in what the budget caps
    # entries that do not say what is overridden, or else what all of them say
    true = [m for m in members if overridden.isdisjoint({*m.own, *PLANNER})] if overridden else []
    parts = [member.label.split(syntax.JOIN) for member in true or members]
    common = [part for part in parts[0] if all(part in other for other in parts)]
    name = _joined(*common, *_values(members[0], overridden))
    return name if overridden and name else SAME.join(labels)


def _values(member: Crossed, overridden: set[str]) -> Iterator[str]:
    """Yield `name=value` of overridden settings; sweeps are part of the label anyhow."""
    for key, name in syntax.short_names(sorted(overridden - member.swept)).items():
        override = member.typed[key]
        yield f"~{name}" if override.prefix == DELETE else f"{name}={override.values[0].text}"


def _joined(*parts: str) -> str:
    return syntax.JOIN.join(part for part in parts if part)
