"""Claims of papers, the rules by which they are judged, their evidence and their verdicts.

The format of rules as data stands at the head of `claim_kinds.yaml` beside this module.
"""

import collections
import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import yaml

from evoexp.registry import CLAIMS, Registration, names, registered
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.parameters import option, planned_replicates
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Comparison
from evoexp.report.statistics.inference import Proportion, fisher_exact, newcombe, runs_for_shares
from evoexp.shipped import config_directory, shipped

OWN = "own"
KINDS: dict[str, dict[str, Any]] = yaml.safe_load(
    Path(__file__).with_name("claim_kinds.yaml").read_text(encoding="utf-8")
)


class Rule(NamedTuple):
    """A claim of a paper, and the rule by which it is judged."""

    name: str  # of the claim: `free_at_via_points`
    claim: str  # the claim in our words; {words} are filled in where it is judged
    source: str  # where the paper makes it
    kind: str  # one of `KINDS`
    reproduced: str  # when the claim is reproduced, in words
    contradicted: str  # when it is contradicted, in words; empty: wherever it is not reproduced
    limits: Mapping[str, float]  # numbers that the rule needs, by name
    experiments: tuple[str, ...]  # names of the experiments that judge it
    evidence: str = ""  # the numbers in a sentence, as `markdown.filled` takes it
    equal: str = ""  # when both sides are practically equal, in words

    def about(self, words: dict[str, object] | None = None) -> "Rule":
        """Return the rule with its words in braces filled in, where no judge gives any with "…"."""
        limits: dict[str, object] = {name: f"{limit:g}" for name, limit in self.limits.items()}
        unknown = collections.defaultdict[str, object](lambda: "…", word="better")
        known = collections.ChainMap(limits, unknown if words is None else words)
        fields = ("claim", "source", "reproduced", "contradicted", "equal")
        return self._replace(**{name: getattr(self, name).format_map(known) for name in fields})

    @property
    def text(self) -> str:
        """The rule in one sentence."""
        verdicts = {
            "reproduced": self.reproduced,
            "practically equal": self.equal,
            "contradicted": self.contradicted,
        }
        return "; ".join(f"{verdict} if {words}" for verdict, words in verdicts.items() if words)


Rules = Mapping[str, Rule]
NO_RULES: Rules = MappingProxyType({})


@functools.cache
def read_rules(path: Path) -> Rules:
    """Read the claims of a file.

    Raises:
        ValueError: If an entry lacks a key, has an unknown key, or another kind than `KINDS`.
    """
    rules = {}
    for name, entry in yaml.safe_load(path.read_text(encoding="utf-8")).items():
        missing = {"claim", "source", "kind", "experiments"} - entry.keys()
        unknown = entry.keys() - ({*Rule._fields} - {"name"})
        if missing or unknown or entry["kind"] not in KINDS:
            raise ValueError(
                f"{name}: must have claim, source, experiments, a kind out of {', '.join(KINDS)}; "
                f"missing: {sorted(missing)}, unknown: {sorted(unknown)}, kind: {entry.get('kind')}"
            )
        own = "reproduced" in entry
        if (entry["kind"] == OWN) != own or ("contradicted" in entry and not own):
            must = f"a rule of kind {OWN}, and no other, says when it is reproduced"
            raise ValueError(f"{name}: {must}")
        words = {"reproduced": "", "contradicted": "", **KINDS[entry["kind"]], **entry}
        least = {"equal": words.pop("least")} if "least" in words else {}
        words["source"], words["experiments"] = str(entry["source"]), tuple(entry["experiments"])
        words["limits"] = MappingProxyType(least | entry.get("limits", {}))
        rules[name] = Rule(name=name, **words)
    return MappingProxyType(rules)


def registered_rules(registration: Registration) -> Rules:
    """Return the rules that a package registers: as a file, or as the value of a module."""
    if registration.file is None:
        return cast(Rules, registration.load())
    with resources.as_file(registration.file) as path:
        return read_rules(path)


REPRODUCED, CONTRADICTED, EQUAL = "reproduced", "contradicted", "practically equal"
UNDECIDED, NOT_JUDGED = "undecided", "not judged"
DEPENDS = "depends on the reading"
MANY_RUNS = 10_000  # beyond which nobody waits for a verdict
ONLY_CONTROLS = "only a control was run"
Evidence = str | Mapping[str, object]
"""The words of the rule's sentence of evidence, or a whole text."""


class Hearing(NamedTuple):
    """One claim before its judge: each method judges it by one kind of rule."""

    rule: Rule  # of the claim, its words filled in
    reason: str  # why nothing is judged ("budget smoke"); empty: claims are judged
    significance: float  # below this adjusted p-value a difference counts

    def every(self, evidence: Evidence, holds: int, done: int, planned: int) -> Claim:
        """Judge a claim about every run."""
        size = self._share(holds, done, 1.0)
        return self._claim("every", evidence, done, 0 < planned <= done, holds < done, size)

    def majority(self, evidence: Evidence, holds: int, done: int) -> Claim:
        """Judge a claim that is reproduced if it holds in more than half of the runs."""
        most, size = holds > done / 2, self._share(holds, done, 0.5)
        return self._claim("majority", evidence, done, most, bool(done) and not most, size)

    def above(self, share: Proportion, level: float) -> Claim:
        """Judge a claim that something holds in more than some percent."""
        interval, least = share.interval(level), 0.01 * self.rule.limits.get("percent", 0.0)
        size = self._share(*share, least)
        holds, fails = interval.low > least, interval.high < least
        return self._claim("above", share.with_interval(level), share.total, holds, fails, size)

    def at_least(self, number: float) -> Claim:
        """Judge a claim about a number that needs no runs."""
        holds = number >= self.rule.limits.get("number", 0.0)
        return self._claim("at least", markdown.number(number), "–", holds, not holds, None)

    def better(self, row: Comparison | None, word: str, told: str = "{}") -> Claim:
        """Judge a claim that the first condition of a comparison is better than the second.

        The word is that of the better one ("lower"); {} in `told` stands for the comparison.
        """
        says = row.says(self.significance) if row else 0
        words = evidence(row, word) if row else "nothing to compare"
        rule = self.rule._replace(reproduced=self.rule.reproduced.replace("{word}", word))
        counted, would_do = row and row.num_runs, row and row.runs_to_decide(self.significance)
        judged = counted, says == 1, says == -1, _least_effect([row] if row else []), would_do
        return self._replace(rule=rule)._claim("better", told.replace("{}", words), *judged)

    def better_than_all(self, evidence: Evidence, rows: Sequence[Comparison]) -> Claim:
        """Judge a claim that a condition is better than each of several others."""
        says = {row.says(self.significance) for row in rows}
        undecided = [row for row in rows if not row.says(self.significance)]
        would_do = max((row.runs_to_decide(self.significance) for row in undecided), default=None)
        judged = _runs(rows), says == {1}, -1 in says, _least_effect(rows), would_do
        return self._claim("better than all", evidence, *judged)

    def best(self, evidence: Evidence, rows: Sequence[Comparison], best_median: bool) -> Claim:
        """Judge a claim that one of several settings is the best."""
        says = {row.says(self.significance) for row in rows}
        holds, size = best_median and 1 in says, _least_effect(rows)
        return self._claim("best", evidence, _runs(rows), holds, -1 in says, size)

    def greater(
        self, evidence: Evidence, one: Proportion, two: Proportion, p_adjusted: float | None = None
    ) -> Claim:
        """Judge a claim that `one` is greater than `two`, by Fisher's exact test.

        Its p-value is given where it is one of several, adjusted.
        """
        p_value = fisher_exact(one, two) if p_adjusted is None else p_adjusted
        says = greater(one, two, p_value, self.significance)
        counted = f"{one.total} and {two.total}"
        is_known = one.total > 0 and two.total > 0
        would_do = runs_for_shares(one, two, self.significance) if is_known else None
        judged = counted, says == 1, says == -1, self._difference(one, two), would_do
        return self._claim("greater", evidence, *judged)

    def same_share(
        self, evidence: Evidence, own: Proportion, printed: Proportion, p_adjusted: float
    ) -> Claim:
        """Judge a claim that gives a share, a sample itself, by Fisher's exact test."""
        differs = own.total > 0 and p_adjusted < self.significance
        counted, size = f"{own.total} and {printed.total}", self._difference(own, printed)
        return self._claim("same share", evidence, counted, False, differs, size)

    def own(
        self, evidence: Evidence, n: object, holds: bool | None, size: EffectSize | None = None
    ) -> Claim:
        """Judge a claim by a rule of its own; n runs, or whatever was counted; None: undecided."""
        decided = holds is not None
        return self._claim(OWN, evidence, n, decided and bool(holds), decided and not holds, size)

    def elsewhere(self, evidence: Evidence) -> Claim:
        """Return the claim unjudged: another experiment judges it, or nothing can."""
        return self.made(evidence, "–", NOT_JUDGED)

    def _share(self, holds: int, done: int, neutral: float) -> EffectSize | None:
        own = Proportion(holds, done)
        ends = own.interval(1.0 - self.significance)
        return EffectSize("share of runs", own.share, *ends, neutral) if done else None

    def _difference(self, one: Proportion, two: Proportion) -> EffectSize:
        ends = newcombe(one, two, 1.0 - self.significance)
        return EffectSize("difference of shares", one.share - two.share, *ends, 0.0)

    def _claim(
        self,
        kind: str,
        evidence: Evidence,
        n: object,
        reproduced: bool,
        contradicted: bool,
        size: EffectSize | None,
        would_decide: float | None = None,  # runs of each condition
    ) -> Claim:
        if kind != self.rule.kind:
            raise ValueError(f"{self.rule.name}: its rule is '{self.rule.kind}', was '{kind}'")
        # a comparison without a pair of runs
        reason = self.reason or ("nothing to compare" if n in (None, "0") else "")
        if reason:
            return self.made(evidence, n, f"{NOT_JUDGED} ({reason})")
        verdict = CONTRADICTED if contradicted else REPRODUCED if reproduced else UNDECIDED
        if size is not None:
            size = size._replace(equal=self.rule.limits.get("equal", 0.0))
            verdict = EQUAL if size.is_negligible else verdict
        claim = self.made(evidence, n, verdict)._replace(size=size)
        if verdict != UNDECIDED or would_decide is None:
            return claim
        if would_decide > MANY_RUNS:
            words = f"more than {MANY_RUNS:,} runs of each would be needed to decide"
        else:
            words = f"about {10 * math.ceil(would_decide / 10)} runs of each would decide"
        return claim._replace(evidence="; ".join(filter(None, (claim.evidence, words))))

    def made(self, evidence: Evidence, n: object, verdict: str) -> Claim:
        """Return the claim with this evidence and verdict."""
        rule, counted = self.rule, "0" if n is None else str(n)
        told = evidence if isinstance(evidence, str) else markdown.filled(rule.evidence, evidence)
        return Claim(rule.claim, rule.source, told, verdict, rule.name, rule.text, counted)


def _least_effect(rows: Sequence[Comparison]) -> EffectSize | None:
    effects = sorted((row.better for row in rows), key=lambda each: each.a12)
    return next((EffectSize("A12", each.a12, *each.interval, 0.5) for each in effects), None)


def _runs(rows: Sequence[Comparison]) -> str:
    """Return the numbers of runs that were compared: "20", or "18 to 20"."""
    counts = sorted({count for row in rows for count in row.sizes})
    return " to ".join(map(str, counts if len(counts) < 2 else (counts[0], counts[-1]))) or "0"


def greater(one: Proportion, two: Proportion, p_value: float, significance: float) -> int:
    """Return 1 if a proportion is greater, −1 if smaller, 0: not significantly by Fisher's test."""
    if not one.total or not two.total or p_value >= significance:
        return 0
    return int(one.share > two.share) - int(one.share < two.share)


class Judge(NamedTuple):
    """Opens the hearings of claims; where nothing is judged, each claim names the reason."""

    reason: str  # why nothing is judged ("budget smoke"); empty: claims are judged
    settings: ReportSettings  # levels and resamples
    rules: Rules = NO_RULES  # of the paper's claims, by name

    @property
    def level(self) -> float:
        """The level of every interval."""
        return self.settings.confidence

    def share(self, proportion: Proportion, decimals: int = 0) -> str:
        """Return a proportion with its interval: "964 of 1000 = 96.4 % [95.1, 97.4]"."""
        return proportion.with_interval(self.level, decimals)

    def on(self, name: str, **words: object) -> Hearing:
        """Open the hearing of a claim, with the words in braces of its texts."""
        # a rule that compares names its own word where it is judged
        rule = self.rules[name].about({"word": "{word}", **words})
        return Hearing(rule, self.reason, self.settings.significance)


def judge(results: Results, settings: ReportSettings, rules: Rules = NO_RULES) -> Judge:
    """Return the judge of an experiment's claims."""
    return Judge(not_judged(results), settings, rules)


def not_judged(results: Results) -> str:
    """Return why claims are not to be judged; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    if results.main and all(c.is_control for c in results.main):
        return ONLY_CONTROLS
    planned = planned_replicates(results)
    if any(c.planned < c.condition.num_replicates(planned) for c in results.conditions):
        return "fewer replicates than planned"
    own = {
        row.condition_id
        for row in shipped()
        if (row.experiment, row.budget) == (results.experiment, "paper")
    }
    seed = option(config_directory() / "config.yaml")["seed"].value  # another one is as good as any
    changed = any(c.condition._replace(seed=seed).id not in own for c in results.conditions)
    if changed if own else not results.as_written:  # a guest's experiment is in no table
        return "settings overridden"
    return ""


def left_out(results: Results, judged: Sequence[Claim]) -> Iterator[Claim]:
    """Yield the claims that an experiment judges on conditions which are not among its results."""
    budget = results.budget if results.budget == "smoke" else "paper"
    rows = [r for r in shipped() if (r.experiment, r.budget) == (results.experiment, budget)]
    missing = {row.label for row in rows} - {c.label for c in results.conditions}
    if not missing:
        return
    known, verdict = {claim.name for claim in judged}, f"{NOT_JUDGED} (conditions left out)"
    for paper in names(CLAIMS):
        registration = registered(CLAIMS, paper)
        assert registration is not None
        for rule in registered_rules(registration).values():
            if results.experiment in rule.experiments and rule.name not in known:
                told = "not among its conditions: " + ", ".join(sorted(missing))
                yield Hearing(rule.about(), "", 0.0).made(told, "0", verdict)


def evidence(comparison: Comparison, better: str) -> str:
    """Return a comparison in words: "lower in 80 % of all pairs of runs (A12 0.801 …"."""
    a12, (low, high) = comparison.better.a12, comparison.better.interval
    return (
        f"{better} in {100 * a12:.0f} % of all pairs of runs (A12 {a12:.3f} [{low:.3f}, "
        f"{high:.3f}], p = {markdown.p_value(comparison.p_adjusted)})"
    )
