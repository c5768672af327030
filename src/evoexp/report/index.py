"""The text of a report: `index.md`."""

from collections.abc import Iterable, Iterator, Sequence

from evoexp.report import markdown
from evoexp.report.page_parts import Drawing, Page
from evoexp.report.parameters import Parameter, parameters, planned_replicates
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results, Verdicts
from evoexp.report.statistics import wilson
from evoexp.report.verdicts import Claim, Comparison

FEW = 3  # damaged logs named of each condition
WIDEST = 20  # conditions side by side; more stand one below the other


def render(page: Page, results: Results, settings: ReportSettings, command: str) -> str:
    """Return the page as Markdown; the same results give the same text.

    Args:
        page: Its parts.
        results: The results that it was drawn from.
        settings: Levels and formats.
        command: The command that makes it.
    """
    parts = [
        f"# {page.title}\n",
        _made_by(results, command),
        _incomplete(results),
        _damaged(results),
        _added(results),
        f"{page.introduction}\n" if page.introduction else "",
        _section("Conditions", _conditions(results, settings)),
        _section("Results", _quantities(page, results)),
        *(
            _section(t.heading, markdown.table(t.headers, t.rows) + f"\n{t.note}\n" * bool(t.note))
            for t in page.tables
        ),
        _section("Claims", _claims(page.claims)),
        _section("Known defects and checks", _checks(page.checks)),
        *(_section(heading, _comparison(rows, settings)) for heading, rows in page.comparisons),
        _section("Motions", _motions(page)),
        _section("Figures", "\n".join(_figure(drawing, settings) for drawing in page.drawings)),
        _section("Parameters", _parameters(results)),
        _section("Failures", _failures(results)),
    ]
    return markdown.inert("\n".join(part for part in parts if part))


def _section(heading: str, text: str) -> str:
    return f"## {heading}\n\n{text}" if text else ""


def _made_by(results: Results, command: str) -> str:
    named = {"experiment": results.experiment, "budget": results.budget}
    words = [f"{kind} `{name}`" for kind, name in named.items() if name]
    return ", ".join([f"Made by `{command}`", *words]) + ".\n"


def _incomplete(results: Results) -> str:
    """Name the replicates that are missing; empty if none is."""
    missing = [
        f"{c.label}: {c.done} of {c.planned} replicates done, {c.failed} failed"
        for c in results.conditions
        if c.done < c.planned
    ]
    return (
        f"> **Partial results.** {'; '.join(missing)}. Everything below is drawn from the "
        "finished replicates.\n" * bool(missing)
    )


def _damaged(results: Results) -> str:
    """Name the logs that are damaged and left out; empty if none is."""
    lost = [
        f"{c.label}: {len(c.damaged)} ({', '.join(list(c.damaged)[:FEW])}"
        + f"{', …' if len(c.damaged) > FEW else ''})"
        for c in results.conditions
        if c.damaged
    ]
    return (
        f"> **Damaged logs.** {'; '.join(lost)} could not be read and are left out; the command "
        "that ran the experiment runs them again.\n" * bool(lost)
    )


def _added(results: Results) -> str:
    """Name the replicates that were added when results could be known; empty if none was."""
    fixed = planned_replicates(results) if results.experiment else 0
    added = [
        f"{c.label}: {n} of {c.done}"
        for c in results.conditions
        if (n := c.added(c.condition.num_replicates(fixed)))
    ]
    return (
        f"> **Replicates added later.** {'; '.join(added)}: asked for when results of earlier ones "
        "were stored already. Numbers and verdicts below use all of them.\n" * bool(added)
    )


def _conditions(results: Results, settings: ReportSettings) -> str:
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
        "yet somewhere closer than the scenario's security margin.\n"
    )
    return f"{markdown.table(headers, rows)}\n{note}"


def _verdicts(verdicts: Verdicts) -> tuple[object, ...]:
    if not verdicts.judged:
        return ("–",) * 4
    return verdicts.certified, verdicts.refuted, verdicts.undecided, verdicts.solved_refuted


def _quantities(page: Page, results: Results) -> str:
    labels = [c.label for c in results.with_data]
    if not labels or not page.quantities:
        return ""
    note = "Median [first quartile, third quartile] over finished replicates.\n"
    heads = [f"{c.label} (n = {c.done})" for c in results.with_data]
    if len(labels) > WIDEST:
        cells = [
            (head, *(markdown.spread(q.spreads[c]) for q in page.quantities))
            for head, c in zip(heads, labels, strict=True)
        ]
        names = [q.name if q.unit == "–" else f"{q.name} [{q.unit}]" for q in page.quantities]
        return f"{markdown.table(('condition', *names), cells)}\n{note}"
    rows = [
        (q.name, q.unit, *(markdown.spread(q.spreads[label]) for label in labels))
        for q in page.quantities
    ]
    return f"{markdown.table(('quantity', 'unit', *heads), rows)}\n{note}"


def _claims(claims: Sequence[Claim]) -> str:
    if not claims:
        return ""
    rows = [
        (c.text, c.source, c.evidence, c.n or "–", c.rule or "–", f"**{c.verdict}**")
        for c in claims
    ]
    return markdown.table(("claim", "paper", "evidence", "n", "rule", "verdict"), rows)


def _checks(checks: Sequence[tuple[str, str]]) -> str:
    return markdown.table(("check", "finding"), checks) if checks else ""


def _comparison(rows: Iterable[Comparison], settings: ReportSettings) -> str:
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
        "samples; adjusted: Holm over the rows of this table, test by test.\n"
    )
    return f"{markdown.table(headers, cells)}\n{note}"


def _motions(page: Page) -> str:
    """Link the pages that play motions."""
    links = [f"- [{motion.title}]({motion.stem}.html)" for motion in page.motions]
    return (
        "\n".join(["Played in a browser, with every exact distance:\n", *links, ""])
        if links
        else ""
    )


def _figure(drawing: Drawing, settings: ReportSettings) -> str:
    shown = next((kind for kind in ("png", "svg") if kind in settings.formats), None)
    kinds = (*settings.formats, "csv", "json")
    links = " · ".join(f"[{kind}]({drawing.stem}.{kind})" for kind in kinds)
    picture = f"![{drawing.title}]({drawing.stem}.{shown})\n\n" if shown else ""
    return f"### {drawing.title}\n\n{picture}{drawing.caption}\n\n{links}\n"


def _parameters(results: Results) -> str:
    """Return one row per setting, and one per value where conditions differ in it."""
    by_name: dict[str, dict[Parameter, list[str]]] = {}
    for condition in results.conditions:
        for parameter in parameters(results, condition):
            by_name.setdefault(parameter.name, {}).setdefault(parameter, []).append(condition.label)
    every = len(results.conditions)
    rows = [
        (
            f"`{name}`" + ("" if len(labels) == every else f" ({', '.join(labels)})"),
            parameter.value,
            parameter.unit or "–",
            parameter.source or "–",
        )
        for name in _ordered(by_name)
        for parameter, labels in by_name[name].items()
    ]
    return markdown.table(("setting", "value", "unit", "source"), rows)


def _ordered(by_name: dict[str, dict[Parameter, list[str]]]) -> Iterator[str]:
    """Yield settings group by group, seed and number of replicates last."""
    groups = list(dict.fromkeys(name.split(".")[0].split("[")[0] for name in by_name))
    groups.sort(key=lambda group: group in ("seed", "num_replicates"))
    for group in groups:
        yield from (name for name in by_name if name.split(".")[0].split("[")[0] == group)


def _failures(results: Results) -> str:
    rows = [
        (c.label, replicate, reason)
        for c in results.conditions
        for replicate, reason in c.failures.items()
    ]
    return markdown.table(("condition", "replicate", "reason"), rows) if rows else ""
