"""Claims of a page: judged as its file says, and under every reading of the paper.

An entry says which runs are judged, what is measured, and beside which others. A reading is a
number or an interpretation that the text leaves open; the functions below give what the page
`readings` of `page.yaml` shows. `read_results` are those of the experiment `<paper>_claims`, or of
some of its conditions.
"""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.pages.page_file import Scope
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.parameters import OVERRIDE, Parameter, parameters
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Comparison, Values, adjusted, beside, compared
from evoexp.report.statistics.inference import Proportion, fisher_exact, fisher_family, spread
from evoexp.report.statistics.judging import DEPENDS, NOT_JUDGED, OWN, UNDECIDED, Hearing, Judge

HIGHER = "higher"  # values of an entry are better so; lower if it does not say
PLANNED = "condition.planned"  # runs of a claim about every one
ELSEWHERE = "judged by `evoexp run experiment={}`"


class _Item(NamedTuple):
    """A claim to be judged: its hearing, the conditions that it compares, and what is measured."""

    scope: Scope  # of the first condition; `own` and `other` are those of the first two
    hearing: Hearing
    words: Mapping[str, str]  # of the claim and its evidence
    conditions: tuple[ConditionResults, ...]  # the first one is compared with the others
    values: Any  # a function of a condition, or a value that needs none

    @property
    def shares(self) -> list[Proportion]:
        """Count the runs of each condition in which something holds."""
        return [_share(self.values(c)) for c in self.conditions]

    def told(self, usual: str, **words: object) -> str:
        """Return the sentence of evidence of the rule, or the usual one of its kind."""
        template = self.hearing.rule.evidence
        words |= self.words
        return markdown.filled(template, self.scope.inner(**words)) if template else usual


def judged_as_written(scopes: Iterable[Scope], entry: Mapping[str, Any]) -> Iterator[Claim]:
    """Judge a claim by the kind of its rule, on each of several items.

    The entry names the rule (`claim`), the condition by its label (`of`; that of the item if it
    names none), the labels of those beside it (`than`), and what is measured (`values`): a quantity
    where conditions are compared, whether something holds where runs are counted, a `Proportion`
    of anything else, or a number; by a rule of its own whether the claim holds. Items of which a
    condition was left out give no claim. The items of a `family` are tests that are adjusted
    together.
    """
    found = [item for scope in scopes for item in _items(scope, entry)]
    families = [found] if entry.get("family") else [[item] for item in found]
    for items in families:
        yield from _claims(items, entry)


def _items(scope: Scope, entry: Mapping[str, Any]) -> Iterator[_Item]:
    by_label = {c.label: c for c in scope["conditions"]}
    than = entry.get("than", [])
    labels = [entry["of"]] if "of" in entry else ["{condition.label}"] * ("condition" in scope)
    labels = [*map(scope.text, [*labels, *([than] if isinstance(than, str) else than)])]
    if not by_label.keys() >= set(labels):
        return
    known = tuple(by_label[label] for label in labels)
    inner = [scope.inner(condition=c) for c in known]
    item_scope = (inner or [scope])[0].inner(**dict(zip(("own", "other"), inner, strict=False)))
    words = {"who": "".join(labels[:1]), "others": ", ".join(labels[1:])}
    words |= {name: item_scope.text(text) for name, text in entry.get("words", {}).items()}
    values = scope.function(entry["values"]) if "values" in entry else None
    judge: Judge = item_scope[entry.get("by", "judge")]
    hearing = judge.on(entry["claim"], **words)
    rule = hearing.rule._replace(evidence=entry.get("evidence", hearing.rule.evidence))
    yield _Item(item_scope, hearing._replace(rule=rule), words, known, values)


def _claims(items: Sequence[_Item], entry: Mapping[str, Any]) -> Iterator[Claim]:
    kind = items[0].hearing.rule.kind if items else ""
    if "unjudged" in entry:
        verdict = f"{judging.NOT_JUDGED} ({entry['unjudged']})"
        for item in items:
            yield item.hearing.made(item.told(""), item.scope["condition"].done, verdict)
    elif entry.get("elsewhere"):
        for item in items:
            yield item.hearing.elsewhere(ELSEWHERE.format(item.hearing.rule.experiments[0]))
    elif kind in ("better", "better than all", "best"):
        settings = items[0].scope["settings"]
        lower = entry.get("better") != HIGHER
        rows = [
            compared(
                [(own, other) for other in others], item.values, settings, lower_is_better=lower
            )
            for item in items
            for own, *others in (item.conditions,)
        ]
        of_family = iter(adjusted(row for own in rows for row in own))
        for item, own in zip(items, rows, strict=True):
            yield _better(item, [next(of_family) for _ in own], entry)
    elif kind == "greater":
        p_values = fisher_family([(one, two) for item in items for one, two in (item.shares,)])
        for item, p in zip(items, p_values, strict=True):
            one, two = item.shares
            shares = " against ".join(item.scope["judge"].share(each) for each in (one, two))
            alone = fisher_exact(one, two)
            usual = f"{shares}; Fisher's exact p = {markdown.p_value(alone)}"
            told = item.told(usual, one=one, two=two, p=alone, p_adjusted=p)
            yield item.hearing.greater(told, one, two, p)
    else:
        yield from (_alone(item, entry) for item in items)


def _better(item: _Item, rows: Sequence[Comparison], entry: Mapping[str, Any]) -> Claim:
    word = str(entry.get("word", entry.get("better", "lower")))
    found = [float(np.median(item.values(c))) for c in item.conditions]
    medians, labels = [*map(markdown.number, found)], [c.label for c in item.conditions]
    effects = [judging.evidence(row, word) for row in rows] or ["nothing to compare"]
    beside = [f"{row.quantity}: {own}" for row, own in zip(rows, effects, strict=False)]
    best = min(range(len(found)), key=lambda k: (k == 0, found[k]))  # of the others, if any
    usual = effects if item.hearing.rule.kind == "better" else beside
    told = item.told(
        "; ".join([f"median {' against '.join(medians)}", *usual]),
        against=" against ".join(medians),
        comparison=effects[0],
        comparisons="; ".join(beside),
        medians=", ".join(map(" ".join, zip(labels, medians, strict=True))),
        median=medians[0],
        best_other=f"{labels[best]}: {medians[best]}",
        outcomes=_outcomes(labels[0], rows, item.hearing.significance),
    )
    match item.hearing.rule.kind:
        case "better":
            return item.hearing.better(next(iter(rows), None), word, told)
        case "best":
            return item.hearing.best(told, rows, found[0] <= min(found[1:]))
        case _:
            return item.hearing.better_than_all(told, rows)


def _outcomes(label: str, rows: Sequence[Comparison], significance: float) -> str:
    """List the conditions that the first is better than, worse than, or not told from."""
    words = {
        1: "is significantly better than",
        -1: "is significantly worse than",
        0: "does not differ significantly from",
    }
    parts = []
    for sign, word in words.items():
        named = [
            f"{row.quantity} (A12 {row.better.a12:.2f}, p = {markdown.p_value(row.p_adjusted)})"
            for row in rows
            if row.says(significance) == sign
        ]
        parts += [f"{word} {', '.join(named)}"] * bool(named)
    return f"{label} {'; '.join(parts)}"


def _alone(item: _Item, entry: Mapping[str, Any]) -> Claim:
    hearing, scope, own = item.hearing, item.scope, next(iter(item.conditions), None)
    value = item.values(own) if callable(item.values) else item.values
    if hearing.rule.kind == OWN:
        n = scope.value(entry["n"]) if "n" in entry else scope["condition"].done
        return hearing.own(item.told(""), n, value)
    if hearing.rule.kind == "at least":
        return hearing.at_least(float(np.asarray(value).item()))
    share = _share(value)
    if hearing.rule.kind == "above":
        return hearing.above(share, scope["judge"].level)
    told = item.told(scope["judge"].share(share), share=share)
    if hearing.rule.kind == "every":
        return hearing.every(told, *share, scope.value(entry.get("planned", PLANNED)))
    return hearing.majority(told, *share)


def _share(holds: Any) -> Proportion:
    return holds if isinstance(holds, Proportion) else counted(holds)


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
    """A condition as assumed, and the conditions that change its numbers."""

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
    """Return the conditions as assumed, each with the ones that override its settings."""
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


def headline_rows(judged: Sequence[Judged]) -> Iterator[tuple[object, ...]]:
    """Yield all verdicts, one row per condition: in the first family it is of."""
    first = {one.condition: one.family for one in reversed(judged)}
    headlines = dict.fromkeys(one.headline for one in judged)
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
        yield condition.label, names, condition.done, *cells


def assumed_rows(read_results: Results, families: Sequence[Family]) -> Iterator[tuple[object, ...]]:
    """Yield every assumed number, with the conditions that vary it."""
    # name of a setting, or of a list of settings → its entries; entry → the varying conditions
    lists: dict[str, dict[Parameter, list[str]]] = {}
    for family in families:
        for parameter in parameters(read_results, family.shipped):
            if ASSUMED in parameter.source:
                names = {parameter.name, parameter.name.split("[")[0]}
                by = [c.label for c, changed in family.varied if names & set(changed)]
                entries = lists.setdefault(_INDEX.sub("[…]", parameter.name), {})
                entries.setdefault(parameter, []).extend(by)
    for name, entries in lists.items():
        values = list(dict.fromkeys(p.value for p in entries))
        reasons = dict.fromkeys(p.source.removeprefix(ASSUMED).lstrip(": ") for p in entries)
        varied = dict.fromkeys(label for labels in entries.values() for label in labels)
        shown = "; ".join(values) if len(values) <= SHOWN else f"{len(values)} values"
        units = dict.fromkeys(p.unit for p in entries)
        reason = "; ".join(filter(None, reasons)) or "–"
        by_label = "; ".join(varied) or "not varied"
        yield f"`{name}`", shown, ", ".join(filter(None, units)) or "–", reason, by_label


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # a headline claim in words
    "curve_title": lambda judged, headline: next(
        one.claim.text.removeprefix(f"{one.condition.label}: ")
        for one in judged
        if one.headline is headline
    ),
    "headline_quantities": lambda headlines: [f"{h.name}: {h.quantity}" for h in headlines],
}
