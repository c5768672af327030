"""An experiment: the labelled conditions that one call asks for."""

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import LARGEST_CAP, Condition
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import Option
from evoexp.validation import Count, Settings

if TYPE_CHECKING:
    from evoexp.configuration.setting_search import Search


def _whole(value: Any) -> Any:
    """Return 1e6 as a whole number, as one types it."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


PAPER = "paper"  # the budget without caps
Queries = Annotated[int, BeforeValidator(_whole), Field(ge=1, le=LARGEST_CAP)]


class Budget(Settings):
    """A cap on what an experiment may cost."""

    name: str  # `paper` caps nothing
    max_replicates: Count | None  # cap on the number of replicates
    max_generations: Count | None  # cap on the number of generations; changes the condition
    # cap on the configurations asked for: a run ends before the generation that takes it beyond;
    # changes the condition
    collision_queries: Queries | None = None


class Labelled(NamedTuple):
    """A condition under the name that figures give it."""

    label: str
    condition: Condition


class Built(NamedTuple):
    """A condition, the options that it was taken from, and whether the budget capped it."""

    condition: Condition
    options: tuple[Option, ...]
    is_capped: bool


class Experiment(NamedTuple):
    """The conditions that one call asks for, and how they are run and reported."""

    name: str  # of the experiment file; "custom" without one
    budget: str  # name of the budget
    num_replicates: int  # of every condition, but for references (`Condition.num_replicates`)
    runner: RunnerSettings  # how to run them
    report: ReportSettings  # how to report them
    # whether overrides or `--only` make this another set of conditions than the file's own
    changed: bool
    conditions: tuple[Labelled, ...] = ()  # in the order of the file, each condition once
    # label → the option that was taken of each group, the experiment file included. No part of
    # any identity: the same settings may come from other options.
    options: Mapping[str, tuple[Option, ...]] = {}
    capped: tuple[str, ...] = ()  # labels of the conditions that the budget changed
    search: "Search | None" = None  # of settings, of which the conditions are the finished trials

    @property
    def report_name(self) -> str:
        """Directory of its report: `<experiment>[@budget][+hash of what was changed]`."""
        if self.search is not None:
            return self.search.folder.name
        name = self.name if self.budget == PAPER else f"{self.name}@{self.budget}"
        if not self.changed:
            return name
        text = "\n".join(f"{label}\t{condition.id}" for label, condition in self.conditions)
        return f"{name}+{hashlib.sha256(text.encode()).hexdigest()[:8]}"

    def of(self, conditions: Mapping[str, Built]) -> "Experiment":
        """Return the experiment with other conditions, by their labels."""
        return self._replace(
            conditions=tuple(Labelled(label, b.condition) for label, b in conditions.items()),
            options={label: built.options for label, built in conditions.items()},
            capped=tuple(label for label, built in conditions.items() if built.is_capped),
        )

    def budget_of(self, label: str) -> str:
        """Return the budget of a condition: `paper` if no cap changed it, whatever is asked for."""
        if label not in self.capped:
            return PAPER
        return f"{PAPER}, capped" if self.budget == PAPER else self.budget

    def origin(self, label: str, command: str) -> dict[str, Any]:
        """Return a condition's origin for the manifest of its run; no part of its identity."""
        return {
            "experiment": self.name,
            "budget": self.budget_of(label),
            "label": label,
            "options": {o.group: {"name": o.name, "origin": o.origin} for o in self.options[label]},
            "command": command,
        }
