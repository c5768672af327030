"""Claims that a page judges as its file says: the runs, what is measured, beside which others."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.pages.page_scope import Scope
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Values, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Hearing, Judge

HIGHER = "higher"  # values of an entry are better so; lower if it does not say


def judged_as_written(scope: Scope, entry: Mapping[str, Any]) -> Iterator[Claim]:
    """Judge a claim by the kind of its rule; nothing where a condition that it needs was left out.

    The entry names the rule (`claim`), the condition by its label (`of`; that of the item if it
    names none), the labels of those beside it (`than`), and what is measured (`values`): a quantity
    where conditions are compared, whether something holds where runs are counted, a `Proportion`
    of anything else, or a number.
    """
    judge: Judge = scope["judge"]
    by_label = {c.label: c for c in scope["conditions"]}
    than = entry.get("than", [])
    beside = [than] if isinstance(than, str) else than
    labels = [scope.text(label) for label in (entry.get("of", "{condition.label}"), *beside)]
    own, *others = map(by_label.get, labels)
    if own is None or None in others:
        return
    words = {name: scope.text(text) for name, text in entry.get("words", {}).items()}
    hearing = judge.on(entry["claim"], who=labels[0], others=", ".join(labels[1:]), **words)
    known = [other for other in others if other is not None]
    yield _claim(judge, hearing, scope.function(entry["values"]), own, known, entry)


def _claim(
    judge: Judge,
    hearing: Hearing,
    values: Values,
    own: ConditionResults,
    others: Sequence[ConditionResults],
    entry: Mapping[str, Any],
) -> Claim:
    match hearing.rule.kind:
        case "better" | "better than all":
            rows = compared(
                [(own, other) for other in others],
                values,
                judge.settings,
                lower_is_better=entry.get("better") != HIGHER,
                named=lambda _, other: other.label,
            )
            word = str(entry.get("word", entry.get("better", "lower")))
            medians = (markdown.number(float(np.median(values(c)))) for c in (own, *others))
            told = f"median {' against '.join(medians)}"
            if hearing.rule.kind == "better":
                return hearing.better(next(iter(rows), None), word, f"{told}; {{}}")
            beside = (f"{row.quantity}: {judging.evidence(row, word)}" for row in rows)
            return hearing.better_than_all("; ".join([told, *beside]), rows)
        case "greater":
            one, two = (_share(values(c)) for c in (own, *others))
            shares = " against ".join(map(judge.share, (one, two)))
            return hearing.greater(f"{shares}; {judging.fisher_evidence(one, two)}", one, two)
        case "above":
            return hearing.above(_share(values(own)), judge.level)
        case "at least":
            return hearing.at_least(float(np.asarray(values(own)).item()))
        case "every":
            share = _share(values(own))
            return hearing.every(judge.share(share), share.having, share.total, own.planned)
        case _:
            return hearing.majority(judge.share(share := _share(values(own))), *share)


def _share(holds: Any) -> Proportion:
    """Return a share as it is, or count the runs in which something holds, (done,) of truth."""
    return holds if isinstance(holds, Proportion) else counted(holds)
