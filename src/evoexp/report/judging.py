"""What the pages of sweeps and methods say alike of a claim.

Whether to judge it, by what numbers, and how it reads.
"""

from evoexp.report import markdown
from evoexp.report.claims import Claim, Comparison
from evoexp.report.parameters import option, planned_replicates
from evoexp.report.results import Results
from evoexp.shipped import config_directory, shipped


def not_judged(results: Results) -> str:
    """Return why claims are not to be judged; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    planned = planned_replicates(results.experiment)
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


def claim(text: str, source: str, evidence: str, verdict: str, reason: str) -> Claim:
    """Return a claim; its verdict names the reason why it is not judged."""
    return Claim(text, source, evidence, f"{verdict} ({reason})" if reason else verdict)


def evidence(comparison: Comparison, better: str) -> str:
    """Return a comparison in words: "lower in 80 % of pairs of runs (…)".

    Both tests are told, by which the verdict is and the other one: they differ where the runs that
    are better are more, but those that are worse are worse by more.
    """
    low, high = comparison.better.interval
    return (
        f"{better} in {100 * comparison.better.a12:.0f} % of pairs of runs (A12 "
        f"{comparison.better.a12:.3f} [{low:.3f}, {high:.3f}]), p = "
        f"{markdown.p_value(comparison.p_adjusted)} by seeds (signed rank), "
        f"{markdown.p_value(comparison.unpaired_adjusted)} unpaired (rank sum)"
    )
