"""Makes the claims of a page: whether they are judged at all, their evidence, their verdicts."""

from collections.abc import Sequence
from typing import NamedTuple

from evoexp.report import markdown, verdicts
from evoexp.report.parameters import option, planned_replicates
from evoexp.report.proportions import Proportion
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results
from evoexp.report.verdicts import Claim, Comparison
from evoexp.shipped import config_directory, shipped


class Judge(NamedTuple):
    """Makes claims with verdicts; where nothing is judged, each claim names the reason instead.

    Attributes:
        reason: Why nothing is judged ("budget smoke"); empty: claims are judged.
        significance: Below this adjusted p-value a difference counts.
    """

    reason: str
    significance: float

    def claim(self, text: str, source: str, evidence: str, verdict: str) -> Claim:
        """Make a claim whose verdict the caller has found."""
        reason = f"{verdicts.NOT_JUDGED} ({self.reason})"
        return Claim(text, source, evidence, reason if self.reason else verdict)

    def every(
        self, text: str, source: str, evidence: str, holds: int, done: int, planned: int
    ) -> Claim:
        """Make a claim about every run; see `verdicts.judge_all`."""
        verdict = verdicts.judge_all(holds, done, planned)
        return self.claim(text, source, evidence, verdict)

    def majority(self, text: str, source: str, evidence: str, holds: int, done: int) -> Claim:
        """Make a claim that is reproduced if it holds in more than half of the runs."""
        verdict = verdicts.REPRODUCED if holds > done / 2 else verdicts.CONTRADICTED
        return self.claim(text, source, evidence, verdict)

    def better(
        self, text: str, source: str, row: Comparison | None, word: str, told: str = "{}"
    ) -> Claim:
        """Make a claim that the first condition of a comparison is better than the second.

        Args:
            text: The claim.
            source: Where the paper makes it.
            row: The comparison; None where the two share no seed.
            word: Of the one that is better: "lower", "earlier".
            told: The evidence; its {} stands for the comparison in words.
        """
        verdict = verdicts.judge_better(row, self.significance)
        words = evidence(row, word) if row else "nothing to compare"
        return self.claim(text, source, told.replace("{}", words), verdict)

    def better_than_all(
        self, text: str, source: str, evidence: str, rows: Sequence[Comparison]
    ) -> Claim:
        """Make a claim that a condition is better than each of several others."""
        verdict = verdicts.judge_better_than_all(rows, self.significance)
        return self.claim(text, source, evidence, verdict)

    def greater(
        self,
        text: str,
        source: str,
        evidence: str,
        one: Proportion,
        two: Proportion,
        p_adjusted: float | None = None,
    ) -> Claim:
        """Make a claim that `one` is greater than `two`; see `verdicts.judge_greater`."""
        verdict = verdicts.judge_greater(one, two, self.significance, p_adjusted)
        return self.claim(text, source, evidence, verdict)


def judge(results: Results, settings: ReportSettings) -> Judge:
    """Return the judge of an experiment's claims."""
    return Judge(not_judged(results), settings.significance)


def not_judged(results: Results) -> str:
    """Return why claims are not to be judged; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    planned = planned_replicates(results)
    if any(c.planned < c.condition.num_replicates(planned) for c in results.conditions):
        return "fewer replicates than planned"
    own = {
        row.condition_id
        for row in shipped()
        if (row.experiment, row.budget) == (results.experiment, "paper")
    }
    seed = option(config_directory() / "config.yaml")["seed"].value  # another one is as good as any
    if any(c.condition._replace(seed=seed).id not in own for c in results.conditions):
        return "settings overridden"
    return ""


def evidence(comparison: Comparison, better: str) -> str:
    """Return a comparison in words: "lower in 80 % of pairs of runs (…)".

    It gives the p-values of both tests, first that of the test which the verdict follows. The two
    differ where more runs are better, but those that are worse are worse by more.
    """
    low, high = comparison.better.interval
    return (
        f"{better} in {100 * comparison.better.a12:.0f} % of pairs of runs (A12 "
        f"{comparison.better.a12:.3f} [{low:.3f}, {high:.3f}]), p = "
        f"{markdown.p_value(comparison.p_adjusted)} by seeds (signed rank), "
        f"{markdown.p_value(comparison.unpaired_adjusted)} unpaired (rank sum)"
    )
