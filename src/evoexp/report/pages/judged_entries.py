"""Claims that a page judges as its file says: the runs, what is measured, beside which others."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.pages.page_scope import Scope
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics import judging
from evoexp.report.statistics.claim_rules import OWN
from evoexp.report.statistics.comparisons import Comparison, adjusted, compared
from evoexp.report.statistics.inference import Proportion, fisher_exact, fisher_family
from evoexp.report.statistics.judging import Hearing, Judge

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
    """Yield the item of a scope, if its conditions are there."""
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
    """Judge the items of a family."""
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
        0: "cannot be told from",
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
    """Judge a claim that compares no conditions."""
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
    """Return a share as it is, or count the runs in which something holds, (done,) of truth."""
    return holds if isinstance(holds, Proportion) else counted(holds)
