"""The page of a paper's readings: its headline claims, judged under every one of them.

A reading is a number or an interpretation that the text leaves open. The functions below give what
the page `readings` of `page.yaml` shows. `read_results` are those of the experiment
`<paper>_claims`, or of some of its conditions.
"""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.parameters import OVERRIDE, Parameter, parameters
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values, beside
from evoexp.report.statistics.inference import spread
from evoexp.report.statistics.judging import DEPENDS, NOT_JUDGED, UNDECIDED

ASSUMED = "assumed"
AS_READ = "as we read it"  # the shipped condition
SHOWN = 4  # values of a list that are written out
_INDEX = re.compile(r"\[\d+\]")


class Headline(NamedTuple):
    """A headline claim of a paper."""

    name: str  # of its rule
    quantity: str  # that is drawn, with its unit
    values: Values  # the quantity of a condition's runs, (done,); inf: never
    # Judges the claim on one condition with its controls; None: it says nothing of this condition
    judge: Callable[[ConditionResults, tuple[ConditionResults, ...]], Claim | None]


class Family(NamedTuple):
    """A condition as assumed, and those that change its numbers."""

    shipped: ConditionResults  # as assumed
    # Each other condition with the names of the settings that it changes
    varied: tuple[tuple[ConditionResults, tuple[str, ...]], ...]

    def reading(self, condition: ConditionResults) -> str:
        """Return the label of a condition without that of the family: "N = 10"."""
        if condition is self.shipped:
            return AS_READ
        return condition.label.removeprefix(f"{self.shipped.label}, ")


class Judged(NamedTuple):
    """A headline claim under one condition."""

    headline: Headline  # the claim
    family: Family  # that the condition belongs to
    condition: ConditionResults  # as assumed, or varied
    claim: Claim  # with evidence and verdict
    same: bool  # whether the verdict is that under the assumed numbers


def families(read_results: Results) -> tuple[Family, ...]:
    """Return the conditions as assumed, each with those that change its settings by overrides."""
    changed = {
        c: tuple(
            p.name
            for p in parameters(read_results, c)
            if p.source == OVERRIDE and p.name not in ("seed", "num_replicates")
        )
        for c in read_results.main
    }
    options = {c: sorted((each.group, each.name) for each in c.options) for c in changed}
    return tuple(
        Family(
            shipped,
            tuple((c, own) for c, own in changed.items() if own and options[c] == options[shipped]),
        )
        for shipped, own_changes in changed.items()
        if not own_changes
    )


def judged(
    read_results: Results, families: Sequence[Family], headlines: Sequence[Headline]
) -> Iterator[Judged]:
    """Judge every headline claim on every condition of a family, first as assumed."""
    for family, headline in itertools.product(families, headlines):
        first = ""
        for condition in (family.shipped, *(varied for varied, _ in family.varied)):
            controls = tuple(
                c
                for c in read_results.evolved
                if c.is_control and beside(condition.condition, c.condition)
            )
            claim = headline.judge(condition, controls)
            if claim is not None:
                first = first or claim.verdict
                yield Judged(headline, family, condition, claim, claim.verdict == first)


def headline_claims(judged: Sequence[Judged]) -> Iterator[Claim]:
    """Yield each claim with its verdict over all readings of a family."""
    for family, headline in dict.fromkeys((one.family, one.headline) for one in judged):
        first, *others = (
            one for one in judged if one.family is family and one.headline is headline
        )
        label = f"{first.condition.label}: "
        text = label + first.claim.text.removeprefix(label)
        verdicts = {family.reading(one.condition): one.claim.verdict for one in others}
        verdict = over_readings(first.claim.verdict, verdicts.values())
        evidence = [first.claim.evidence] if first.claim.evidence else []
        for word in dict.fromkeys(verdicts.values()):
            if word != first.claim.verdict:
                own = ", ".join(name for name, other in verdicts.items() if other == word)
                evidence.append(f"{word} if {own}")
        yield first.claim._replace(text=text, verdict=verdict, evidence="; ".join(evidence))


def over_readings(first: str, others: Iterable[str]) -> str:
    """Return the verdict over several readings, from the verdict under each, the default first.

    Where readings are decided, and not all alike, it depends on the reading: "depends on the
    reading (reproduced under 11 of 12)". Where most of them are undecided, so is the claim.
    """
    verdicts = [first, *others]
    judged = [verdict for verdict in verdicts if not verdict.startswith(NOT_JUDGED)]
    if not judged or len(verdicts) == 1:
        return first
    counts = Counter(judged)
    decided = [word for word in counts if word != UNDECIDED]
    if len(decided) == 1 and 2 * counts[decided[0]] > len(judged):
        return f"{decided[0]} ({_under(decided[0], counts)})"
    if not decided:
        return f"{UNDECIDED} ({_under(UNDECIDED, counts)})"
    words = ", ".join(f"{word} {_under(word, counts)}" for word in decided)
    return f"{DEPENDS if len(decided) > 1 else UNDECIDED} ({words})"


def _under(word: str, counts: Counter[str]) -> str:
    having, total = counts[word], counts.total()
    return f"under all {total} readings" if having == total else f"under {having} of {total}"


def headline_rows(judged: Sequence[Judged]) -> list[tuple[object, ...]]:
    """Return all verdicts, one row per condition: in the first family it is of."""
    first = {one.condition: one.family for one in reversed(judged)}
    headlines = dict.fromkeys(one.headline for one in judged)
    rows = list[tuple[object, ...]]()
    for condition in dict.fromkeys(one.condition for one in judged):
        family = first[condition]
        own = {
            one.headline: f"{markdown.spread(spread(one.headline.values(condition)))}: "
            f"{one.claim.verdict if one.same else f'**{one.claim.verdict}**'}"
            for one in judged
            if one.family is family and one.condition is condition
        }
        changed = dict(family.varied).get(condition, ())
        cells = (own.get(headline, "–") for headline in headlines)
        names = ", ".join(f"`{name}`" for name in changed) or AS_READ
        rows.append((condition.label, names, condition.done, *cells))
    return rows


def assumed_rows(read_results: Results, families: Sequence[Family]) -> list[tuple[object, ...]]:
    """Return every assumed number, with the conditions that vary it."""
    # name of a setting, or of a list of settings → its entries; entry → the varying conditions
    lists: dict[str, dict[Parameter, list[str]]] = {}
    for family in families:
        for parameter in parameters(read_results, family.shipped):
            if ASSUMED in parameter.source:
                names = {parameter.name, parameter.name.split("[")[0]}
                by = [c.label for c, changed in family.varied if names & set(changed)]
                entries = lists.setdefault(_INDEX.sub("[…]", parameter.name), {})
                entries.setdefault(parameter, []).extend(by)
    rows = list[tuple[object, ...]]()
    for name, entries in lists.items():
        values = list(dict.fromkeys(p.value for p in entries))
        reasons = dict.fromkeys(p.source.removeprefix(ASSUMED).lstrip(": ") for p in entries)
        varied = dict.fromkeys(label for labels in entries.values() for label in labels)
        shown = "; ".join(values) if len(values) <= SHOWN else f"{len(values)} values"
        units = dict.fromkeys(p.unit for p in entries)
        reason = "; ".join(filter(None, reasons)) or "–"
        by_label = "; ".join(varied) or "not varied"
        rows.append((f"`{name}`", shown, ", ".join(filter(None, units)) or "–", reason, by_label))
    return rows


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # a headline claim in words
    "curve_title": lambda judged, headline: next(
        one.claim.text.removeprefix(f"{one.condition.label}: ")
        for one in judged
        if one.headline is headline
    ),
    "headline_quantities": lambda headlines: [f"{h.name}: {h.quantity}" for h in headlines],
}
