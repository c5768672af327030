"""Labels of conditions: every condition has one, and it is true of the condition.

Where the command line overrides a setting in which an experiment's conditions differ, the file's
label alone would be false, and several labels may be of one condition. Such a condition is named by
the overriding setting, behind the parts that the labels have in common.
"""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from evoexp.configuration.experiment import Built
from evoexp.configuration.overrides import AROUND, DELETE, JOIN, Choice, short_names
from evoexp.errors import SettingError

SAME = " ≡ "  # between labels of one condition
PLANNER = ("planner", *AROUND)  # groups whose option makes any label of a planner false


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


def labels_of(groups: Sequence[Group]) -> list[str]:
    """Return the label of each condition, no two of which are equal."""
    # keys in which the entries of the experiment's file differ
    rows = [member for members, _ in groups for member in members]
    varied = set[str]()
    for key in {key for row in rows for key in row.own}:
        if len({row.own[key].word if key in row.own else None for row in rows}) > 1:
            varied.add(key)
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
    parts = [member.label.split(JOIN) for member in true or members]
    common = [part for part in parts[0] if all(part in other for other in parts)]
    name = _joined(*common, *_values(members[0], overridden))
    return name if overridden and name else SAME.join(labels)


def _values(member: Crossed, overridden: set[str]) -> Iterator[str]:
    """Yield `name=value` of overridden settings; sweeps are part of the label anyhow."""
    for key, name in short_names(sorted(overridden - member.swept.keys())).items():
        override = member.typed[key]
        yield f"~{name}" if override.prefix == DELETE else f"{name}={override.values[0].text}"


def _joined(*parts: str) -> str:
    return JOIN.join(part for part in parts if part)
