"""Labels of conditions: every condition has one, and it is true of the condition.

Where the command line overrides a setting in which an experiment's conditions differ, the file's
label may be false, and several labels may be of one condition. Such a condition has the label of
the file's condition that it still is, or else is named by its planner, or the overriding setting.
"""

from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from evoexp.configuration.experiment import Built
from evoexp.configuration.overrides import AROUND, DELETE, JOIN, NOT_IDENTITY, Choice, short_names
from evoexp.errors import SettingError

SAME = " ≡ "  # between labels of one condition
PLANNER = ("planner", *AROUND)  # groups whose option is named by the planner that comes of it


class Crossed(NamedTuple):
    """An entry of an experiment's conditions with one value of each override."""

    experiment: str  # its name is the label where nothing else tells conditions apart
    entry: str  # label in the experiment's file; empty if the file labels no conditions
    # key → `name=value` of the overrides that the command line sweeps over
    swept: Mapping[str, str]
    problem: str  # name of the problem of a folder of problems; else empty
    own: Choice  # overrides of the entry, each with one value
    typed: Choice  # overrides of the command line that concern the condition, each with one value
    choice: Choice  # all overrides of the condition, each with one value

    @property
    def label(self) -> str:
        """The label by what the entry and the sweep say."""
        return _joined(self.entry, *self.swept.values(), self.problem) or self.experiment

    def is_named(self, labels: Iterable[str]) -> bool:
        """Whether one of some labels is the entry's or this combination's."""
        return not {self.entry, self.label}.isdisjoint(labels)


Group = tuple[Sequence[Crossed], Built]  # all combinations, in order, that are one condition
Holds = Callable[[Crossed, Choice], bool]  # whether a condition is the same with another choice


def refuse_equal_labels(rows: Iterable[Crossed]) -> None:
    """Refuse labels that occur twice, or cannot be printed."""
    labels = set[str]()
    for row in rows:
        if not row.label.isprintable():
            raise SettingError("conditions", "labels of printable characters", row.label)
        if row.label in labels:
            raise SettingError("conditions", "labels that differ", row.label)
        labels.add(row.label)


def rejoined(parts: Sequence[str], labels: Container[str]) -> list[str]:
    """Join the parts of labels that were split at commas of theirs; the longest label wins."""
    found, start = list[str](), 0
    while start < len(parts):
        ends = range(len(parts), start, -1)
        end = next((k for k in ends if ", ".join(parts[start:k]) in labels), start + 1)
        found.append(", ".join(parts[start:end]))
        start = end
    return found


def labels_of(groups: Sequence[Group], holds: Holds) -> list[str]:
    """Return the label of each condition; refuse one that two conditions would have."""
    # keys in which the entries of the experiment's file differ
    rows = [member for members, _ in groups for member in members]
    varied = set[str]()
    for key in {key for row in rows for key in row.own}:
        if len({row.own[key].word if key in row.own else None for row in rows}) > 1:
            varied.add(key)
    planners = [built.condition.planner.component for _, built in groups]
    labels = [_label(*each, varied, holds) for each in zip(groups, planners, strict=True)]
    if len(set(labels)) < len(labels):  # planners of one component
        labels = [_label(group, "", varied, holds) for group in groups]
    if twice := [label for label, count in Counter(labels).items() if count > 1]:
        raise SettingError("conditions", "labels that differ", twice[0])
    return labels


def _label(group: Group, planner: str, varied: set[str], holds: Holds) -> str:
    """Return the label of a condition; without a planner's name the overrides themselves."""
    members, built = group
    overridden = varied.intersection(*(member.typed for member in members))
    swept = {key for member in members for key in member.swept}
    if not overridden and built.is_capped and not swept:
        return members[0].label  # others differ from it in what the budget caps
    if not overridden:
        return SAME.join(dict.fromkeys(member.label for member in members))
    # a sweep over settings shows each of its values
    if not overridden & swept - {*PLANNER}:
        holders = [m for m in members if holds(m, _without(m, varied))]
        if holders:
            return SAME.join(dict.fromkeys(_relabelled(m, m.entry, overridden) for m in holders))
    true = [m for m in members if overridden.isdisjoint({*m.own, *PLANNER})]
    parts = [member.entry.split(JOIN) for member in true or members]
    common = _joined(*(part for part in parts[0] if all(part in other for other in parts)))
    names = {
        _relabelled(member, _joined(common, *_values(member, overridden, planner)), overridden)
        for member in members
    }
    return SAME.join(sorted(names))


def _relabelled(member: Crossed, entry: str, overridden: set[str]) -> str:
    """Return a label with another text for its entry, and without some swept overrides."""
    return member._replace(
        entry=entry,
        swept={key: text for key, text in member.swept.items() if key not in overridden},
    ).label


def _values(member: Crossed, overridden: set[str], planner: str) -> Iterator[str]:
    """Yield the texts for overridden settings: the planner's name once, others as `name=value`."""
    by_planner = planner and not overridden.isdisjoint(PLANNER)
    if by_planner:
        yield planner
    keys = sorted(key for key in overridden if not (by_planner and key in PLANNER))
    for key, name in short_names(keys).items():
        override = member.typed[key]
        yield f"~{name}" if override.prefix == DELETE else f"{name}={override.values[0].text}"


def _without(member: Crossed, varied: set[str]) -> Choice:
    """Return a combination's choice without overrides of fields that the file's conditions vary."""
    taken_back = {
        key
        for key, override in member.typed.items()
        if override.root not in NOT_IDENTITY
        and any(key == each or key.startswith(f"{each}.") for each in varied)
    }
    rest = {key: each for key, each in member.choice.items() if key not in taken_back}
    return rest | {key: member.own[key] for key in taken_back if key in member.own}


def _joined(*parts: str) -> str:
    return JOIN.join(part for part in parts if part)
