"""What an experiment is, and which ones there are."""

import hashlib
from typing import NamedTuple

from evoexp import shipped
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.report.report_settings import ReportSettings


class Labelled(NamedTuple):
    """A condition under the name that figures give it."""

    label: str
    condition: Condition


class Experiment(NamedTuple):
    """What one call asks for.

    Attributes:
        name: Of the experiment file; "custom" without one.
        budget: Name of the budget.
        conditions: In the order of the file; two labels may share a condition.
        num_replicates: Of every condition, but for references (`Condition.num_replicates`).
        runner: How to run them.
        report: How to report them.
        changed: Whether overrides or `--only` make this another set of conditions than the file's
            own.
    """

    name: str
    budget: str
    conditions: tuple[Labelled, ...]
    num_replicates: int
    runner: RunnerSettings
    report: ReportSettings
    changed: bool

    @property
    def report_name(self) -> str:
        """Directory of its report: `<experiment>[@budget][+hash of what was changed]`."""
        name = self.name if self.budget == "paper" else f"{self.name}@{self.budget}"
        if not self.changed:
            return name
        text = "\n".join(f"{label}\t{condition.id}" for label, condition in self.conditions)
        return f"{name}+{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def options(group: str) -> list[str]:
    """Return the names of a group's shipped options."""
    return sorted(path.stem for path in (shipped.config_directory() / group).glob("*.yaml"))


def description(experiment: str) -> str:
    """Return the line of an experiment file that says what it is: its third."""
    lines = (
        (shipped.config_directory() / "experiment" / f"{experiment}.yaml").read_text().splitlines()
    )
    return lines[2].removeprefix("# ")
