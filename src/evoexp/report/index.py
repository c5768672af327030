"""The text of a report, from its page and its results."""

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from evoexp.report import markdown
from evoexp.report.condition_labels import have_two_parts, in_few_words
from evoexp.report.page_parts import Drawing, Page
from evoexp.report.page_text import (
    Document,
    FigureText,
    LogText,
    Notice,
    RunText,
    Section,
    TableText,
    Verdict,
    provenance,
)
from evoexp.report.parameters import Parameter, parameters, planned_replicates
from evoexp.report.players import Players, key
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results, Verdicts
from evoexp.report.statistics import wilson
from evoexp.report.verdicts import Claim, Comparison

FEW = 3  # damaged logs named of each condition
WIDEST = 20  # conditions side by side; more stand one below the other
LONGEST_NAME = 40  # letters of a table's heading in the name of its file
PARTS = (
    "In brackets: the conditions that have a value, where not all have it. A planner alone stands "
    "for it on all problems, a problem alone for all of its planners."
)
CLAIMS, FAILURES = "Claims", "Failures"  # headings


def document(
    page: Page,
    results: Results,
    settings: ReportSettings,
    command: str,
    players: Players | None = None,
) -> Document:
    """Return the text of a page; the same results give the same text."""
    notices = (_incomplete(results), _damaged(results), _added(results))
    sections = (
        Section("Conditions", table=_conditions(results, settings)),
        Section("Results", table=_quantities(page, results)),
        *(Section(t.heading, table=TableText(t.headers, t.rows, t.note)) for t in page.tables),
        Section(CLAIMS, table=_claims(page.claims)),
        Section("Known defects and checks", table=_checks(page.checks)),
        *(
            Section(heading, table=_comparison(rows, settings))
            for heading, rows in page.comparisons
        ),
        Section(
            "Figures",
            figures=tuple(_figure(each, settings, players or {}) for each in page.drawings),
        ),
        Section("Parameters", table=_parameters(results)),
        Section(FAILURES, table=_failures(results)),
    )
    return Document(
        page.title,
        command,
        results.experiment,
        results.budget,
        tuple(notice for notice in notices if notice.text),
        page.introduction,
        _with_files(each for each in sections if each.table or each.figures),
        tuple(map(_run, results.conditions)),
        _seeds(results.conditions),
    )


def _run(c: ConditionResults) -> RunText:
    """Return a run, with the addresses of its logs as seen from `reports/<name>/`."""

    def address(path: Path) -> str:
        return Path("../..", *path.parts[-4:]).as_posix()  # runs/<hash>/replicates/<file>

    words = {True: ", certified", False: ", refuted"}
    results = {
        int(k): f"{markdown.number(float(cost))}{words.get(certified, '')}"
        for k, cost, certified in zip(
            c.summaries.index, c.column("best_cost"), c.column("certified"), strict=True
        )
    }
    done = (LogText(k, address(c.run.log_path(k)), text) for k, text in results.items())
    failed = (LogText(k, address(c.run.failure_path(k)), "failed") for k in c.failures)
    logs = tuple(sorted((*done, *failed)))
    own = c.label, c.condition.id, c.done, c.planned, c.failed, c.is_reference
    return RunText(*own, logs)


def _with_files(sections: Iterable[Section]) -> tuple[Section, ...]:
    """Name the files of tables: by their number and heading."""
    found: list[Section] = []
    for section in sections:
        table, number = section.table, 1 + sum(each.table is not None for each in found)
        if table is not None:
            words = "_".join(re.findall("[a-z0-9]+", section.heading.lower()))[:LONGEST_NAME]
            table = table._replace(file=f"table_{number}_{words}".rstrip("_") + ".tex")
        found.append(section._replace(table=table))
    return tuple(found)


def _seeds(conditions: Iterable[ConditionResults]) -> tuple[int, ...]:
    return tuple(sorted({c.condition.seed for c in conditions}))


def render(page: Page, results: Results, settings: ReportSettings, command: str) -> str:
    """Return the page as Markdown; see `document`."""
    return markdown.page(document(page, results, settings, command))


def _incomplete(results: Results) -> Notice:
    """Name the replicates that are missing; empty if none is."""
    missing = [
        f"{c.label}: {c.done} of {c.planned} replicates done, {c.failed} failed"
        for c in results.conditions
        if c.done < c.planned
    ]
    return Notice(
        "Partial results",
        f"{'; '.join(missing)}. Everything below is drawn from the finished replicates."
        * bool(missing),
    )


def _damaged(results: Results) -> Notice:
    """Name the logs that are damaged and left out; empty if none is."""
    lost = [
        f"{c.label}: {len(c.damaged)} ({', '.join(list(c.damaged)[:FEW])}"
        + f"{', …' if len(c.damaged) > FEW else ''})"
        for c in results.conditions
        if c.damaged
    ]
    return Notice(
        "Damaged logs",
        f"{'; '.join(lost)} could not be read and are left out; the command that ran the "
        "experiment runs them again." * bool(lost),
    )


def _added(results: Results) -> Notice:
    """Name the replicates that were added when results could be known; empty if none was."""
    fixed = planned_replicates(results) if results.experiment else 0
    added = [
        f"{c.label}: {n} of {c.done}"
        for c in results.conditions
        if (n := c.added(c.condition.num_replicates(fixed)))
    ]
    return Notice(
        "Replicates added later",
        f"{'; '.join(added)}: asked for when results of earlier ones were stored already. Numbers "
        "and verdicts below use all of them." * bool(added),
    )


def _conditions(results: Results, settings: ReportSettings) -> TableText:
    rows = []
    for c in results.conditions:
        interval = (
            markdown.percent(wilson(c.solved, c.done, settings.confidence)) if c.done else "–"
        )
        solved = f"{markdown.share(c.solved, c.done)} ({interval})" if c.done else "–"
        verdicts = c.verdicts
        broken = verdicts.margin_broken if verdicts.judged else "–"
        rows.append(
            (
                c.label,
                f"`{c.condition.id[:12]}`",
                c.done,
                c.planned,
                c.failed,
                solved,
                *_verdicts(verdicts),
                broken,
            )
        )
    exact = ("certified", "refuted", "undecided", "solved, yet refuted")
    own = ("condition", "hash", "done", "planned", "failed", "solved")
    headers = (*own, *exact, "required margin not kept")
    level = f"{100 * settings.confidence:g} %"
    note = (
        "\"Solved\": the paper's own model accepts the best solution; in brackets Wilson's "
        f'{level} interval. "Certified", "refuted": the exact verdict on the whole continuous '
        'motion, by the distance of the bodies themselves; "required margin not kept": certified, '
        "yet somewhere closer than the scenario's security margin."
    )
    return TableText(headers, tuple(rows), note)


def _verdicts(verdicts: Verdicts) -> tuple[object, ...]:
    if not verdicts.judged:
        return ("–",) * 4
    return verdicts.certified, verdicts.refuted, verdicts.undecided, verdicts.solved_refuted


def _quantities(page: Page, results: Results) -> TableText | None:
    labels = [c.label for c in results.with_data]
    if not labels or not page.quantities:
        return None
    note = "Median [first quartile, third quartile] over finished replicates."
    heads = [f"{c.label} (n\u00a0=\u00a0{c.done})" for c in results.with_data]
    if len(labels) > WIDEST:
        cells = [
            (head, *(markdown.spread(q.spreads[c]) for q in page.quantities))
            for head, c in zip(heads, labels, strict=True)
        ]
        names = [q.name if q.unit == "–" else f"{q.name} [{q.unit}]" for q in page.quantities]
        return TableText(("condition", *names), tuple(cells), note)
    rows = [
        (q.name, q.unit, *(markdown.spread(q.spreads[label]) for label in labels))
        for q in page.quantities
    ]
    return TableText(("quantity", "unit", *heads), tuple(rows), note)


def _claims(claims: Sequence[Claim]) -> TableText | None:
    if not claims:
        return None
    rows = [
        (c.text, Verdict(c.verdict), c.evidence, c.n or "–", c.rule or "–", c.source)
        for c in claims
    ]
    return TableText(("claim", "verdict", "evidence", "n", "rule", "paper"), tuple(rows))


def _checks(checks: Sequence[tuple[str, str]]) -> TableText | None:
    return TableText(("check", "finding"), tuple(checks)) if checks else None


def _comparison(rows: Iterable[Comparison], settings: ReportSettings) -> TableText:
    cells = [
        (
            c.quantity,
            c.num_seeds,
            markdown.number(c.median_difference),
            f"{c.better.a12:.3f} [{c.better.interval.low:.3f}, {c.better.interval.high:.3f}]",
            markdown.p_value(c.test.p_value),
            markdown.p_value(c.p_adjusted),
            markdown.p_value(c.unpaired.p_value),
            markdown.p_value(c.unpaired_adjusted),
        )
        for c in rows
    ]
    tests = ("Wilcoxon p", "adjusted", "Mann–Whitney p", "adjusted")
    headers = ("quantity", "common seeds", "median difference", "A12 of being better", *tests)
    note = (
        "Difference: first minus second, seed by seed. A12 (Vargha and Delaney): probability "
        "that a run of the first is better than one of the second, ties count half; in brackets "
        f"the {100 * settings.confidence:g} % percentile interval of {settings.num_resamples} "
        "resamples of seeds. Two tests, two-sided: Wilcoxon's signed-rank test of the pairs, "
        "which verdicts follow, and Mann and Whitney's of the same values as independent "
        "samples; adjusted: Holm over the rows of this table, test by test."
    )
    return TableText(headers, tuple(cells), note)


def _figure(drawing: Drawing, settings: ReportSettings, players: Players) -> FigureText:
    runs = [(c.condition.id[:12], c.done) for c in drawing.conditions]
    whose = provenance(runs, _seeds(drawing.conditions))
    caption = f"{drawing.caption} {whose}".strip()
    motions = tuple(players[key(run)].text for run in drawing.plays if key(run) in players)
    return FigureText(drawing.stem, drawing.title, caption, tuple(settings.formats), motions)


def _parameters(results: Results) -> TableText:
    """Return one row per setting, and one per value where conditions differ in it."""
    by_name: dict[str, dict[Parameter, list[str]]] = {}
    for condition in results.conditions:
        for parameter in parameters(results, condition):
            by_name.setdefault(parameter.name, {}).setdefault(parameter, []).append(condition.label)
    every = [condition.label for condition in results.conditions]
    rows = [
        (
            f"`{name}`"
            + ("" if len(labels) == len(every) else f" ({in_few_words(labels, every)})"),
            parameter.value,
            parameter.unit or "–",
            parameter.source or "–",
        )
        for name in _ordered(by_name)
        for parameter, labels in by_name[name].items()
    ]
    note = PARTS * have_two_parts(every)
    return TableText(("setting", "value", "unit", "source"), tuple(rows), note)


def _ordered(by_name: dict[str, dict[Parameter, list[str]]]) -> Iterator[str]:
    """Yield settings group by group, seed and number of replicates last."""
    groups = list(dict.fromkeys(name.split(".")[0].split("[")[0] for name in by_name))
    groups.sort(key=lambda group: group in ("seed", "num_replicates"))
    for group in groups:
        yield from (name for name in by_name if name.split(".")[0].split("[")[0] == group)


def _failures(results: Results) -> TableText | None:
    rows = [
        (c.label, replicate, reason)
        for c in results.conditions
        for replicate, reason in c.failures.items()
    ]
    return TableText(("condition", "replicate", "reason"), tuple(rows)) if rows else None
