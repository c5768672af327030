"""The text of a report, from its page and its results."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from evoexp.report.pages import markdown
from evoexp.report.pages.page_file import own_pages
from evoexp.report.pages.page_parts import Claim, Document, Page, Player, Table, Verdict
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.parameters import Parameter, parameters, planned_replicates
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison
from evoexp.report.statistics.inference import Proportion
from evoexp.shipped import config_directory, described

FEW = 3  # damaged logs named of each condition
WIDEST = 20  # conditions side by side; more stand one below the other
MOST_NAMED = 4  # runs whose hashes a caption spells out
LONGEST_NAME = 40  # letters of a table's heading in the name of its file
BETWEEN = " · "  # the parts of a label of a problem and a planner
OUR_QUESTION = "our question"  # begins the source of a claim that no paper makes
CLAIMS, FIGURES, FAILURES = "Claims", "Figures", "Failures"  # headings


def document(
    page: Page,
    results: Results,
    settings: ReportSettings,
    command: str,
    players: Mapping[tuple[str, int], Player],
) -> Document:
    """Return the text of a page, with the players of motions by the keys of the played runs."""
    claims = (
        (c.text, _verdict(c), c.evidence, c.n or "–", c.rule or "–", c.source) for c in page.claims
    )
    failures = (
        (c.label, replicate, reason)
        for c in results.conditions
        for replicate, reason in c.failures.items()
    )
    # what came out, before what it follows from
    tables = (
        _table("claims", claims),
        _conditions(results, settings),
        _quantities(page, results),
        *page.tables,
        Table("Known defects and checks", ("check", "finding"), page.checks),
        *(_comparison(heading, rows, settings) for heading, rows in page.comparisons),
    )
    above = _numbered(tables, 1)
    return Document(
        page.title,
        command,
        results.experiment,
        results.budget,
        tuple(_notices(results)),
        " ".join(filter(None, (_asked(page, results.experiment), page.introduction))),
        above,
        tuple(
            each._replace(caption=f"{each.caption} {provenance(each.conditions)}".strip())
            for each in page.drawings
        ),
        _numbered((_parameters(results), _table("failures", failures)), len(above) + 1),
        results.conditions,
        provenance(results.conditions),
        tuple(settings.formats),
        players,
    )


def _asked(page: Page, experiment: str) -> str:
    """Return the description of a shipped experiment whose page has but its name as title."""
    if not experiment or experiment not in page.title:
        return ""
    text = described(config_directory() / "experiment" / f"{experiment}.yaml")
    return text.partition("; then: ")[0].rstrip(".") + "." * bool(text)


def _verdict(claim: Claim) -> Verdict:
    number = f"n = {claim.n}" if claim.n not in ("", "–") else ""
    if claim.size is not None:
        number = f"{claim.size.name} {claim.size.value:.3g}"
    return Verdict(claim.verdict, number, claim.source.startswith(OUR_QUESTION), claim.name)


def _numbered(tables: Iterable[Table], first: int) -> tuple[Table, ...]:
    """Return the tables that have rows, with the names of their files, counted from the first."""
    numbered = list[Table]()
    for number, table in enumerate((table for table in tables if table.rows), first):
        words = "_".join(re.findall("[a-z0-9]+", table.heading.lower()))[:LONGEST_NAME]
        numbered.append(table._replace(file=f"table_{number}_{words}".rstrip("_") + ".tex"))
    return tuple(numbered)


def run_logs(c: ConditionResults) -> list[tuple[int, str, str]]:
    """Return (replicate, address, result) of the logs of a run, as seen from `reports/<name>/`.

    Of a failed replicate it is the file that tells why.
    """

    def address(path: Path) -> str:
        return Path("../..", *path.parts[-4:]).as_posix()  # runs/<hash>/replicates/<file>

    words = {True: ", certified", False: ", refuted"}
    logs = [(k, address(c.run.failure_path(k)), "failed") for k in c.failures]
    for k, cost, certified in zip(
        map(int, c.summaries.index), c.column("best_cost"), c.column("certified"), strict=True
    ):
        result = f"{markdown.number(float(cost))}{words.get(certified, '')}"
        logs.append((k, address(c.run.log_path(k)), result))
    return sorted(logs)


def provenance(conditions: Sequence[ConditionResults]) -> str:
    """Return the sentence that tells whose runs something shows; empty without any."""
    if not conditions:
        return ""
    least, most = (f(c.done for c in conditions) for f in (min, max))
    number = str(least) if least == most else f"{least}–{most}"
    each = " of each condition" if len(conditions) > 1 else ""
    seeds = sorted({c.condition.seed for c in conditions})
    names = list(dict.fromkeys(f"`{c.hash12}`" for c in conditions))
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return (
        f"n = {number}{each}, seed{'s' * (len(seeds) > 1)} {', '.join(map(str, seeds))}; "
        f"run{'s' * (len(names) > 1)} {', '.join(names[:MOST_NAMED])}{more}."
    )


def _notices(results: Results) -> Iterator[tuple[str, str]]:
    """Yield the remarks on smoke runs, and on replicates that are missing, unreadable or added."""
    if results.budget == "smoke":
        text = "It shows that everything works; nothing can be concluded from its numbers."
        yield "A smoke run", text
    fixed = planned_replicates(results) if results.experiment else 0
    missing, lost, added = list[str](), list[str](), list[str]()
    for c in results.conditions:
        if c.done < c.planned:
            done = f"{c.done} of {c.planned} replicates done"
            missing.append(f"{c.label}: {done}, {len(c.failures)} failed")
        if c.damaged:
            names = [*list(c.damaged)[:FEW], *["…"] * (len(c.damaged) > FEW)]
            lost.append(f"{c.label}: {len(c.damaged)} ({', '.join(names)})")
        if count := c.added(c.condition.num_replicates(fixed)):
            added.append(f"{c.label}: {count} of {c.done}")
    remarks = {
        "Partial results": (missing, ". Everything below is drawn from the finished replicates."),
        "Damaged logs": (lost, " could not be read and are left out; run the experiment again."),
        "Replicates added later": (added, ": added to stored results, and used below."),
    }
    for title, (own, end) in remarks.items():
        if own:
            yield title, "; ".join(own) + end


def _table(
    name: str, rows: Iterable[tuple[object, ...]], behind: Sequence[str] = (), **words: object
) -> Table:
    """Return a table of `page.yaml`, with the words in braces filled in, and further columns."""
    entry = own_pages().entries["tables"][name]
    heading, note = (entry.get(part, "").format(**words) for part in ("heading", "note"))
    return Table(heading, (*entry["headers"], *behind), tuple(rows), note)


def _conditions(results: Results, settings: ReportSettings) -> Table:
    rows = []
    for c in results.conditions:
        solved, found = "–", c.verdicts
        if c.done:
            share = Proportion(c.solved, c.done)
            solved = f"{share} ({markdown.percent(share.interval(settings.confidence))})"
        exact: tuple[object, ...] = ("–",) * 5
        if found.judged:
            proven = found.certified, found.refuted, found.undecided
            exact = (*proven, found.solved_refuted, found.margin_broken)
        rows.append((c.label, f"`{c.hash12}`", c.done, c.planned, len(c.failures), solved, *exact))
    return _table("conditions", rows, level=100 * settings.confidence)


def _quantities(page: Page, results: Results) -> Table:
    labels = [c.label for c in results.with_data]
    heads = [f"{c.label} (n\u00a0=\u00a0{c.done})" for c in results.with_data]
    cells = [[markdown.spread(q.spreads[label]) for label in labels] for q in page.quantities]
    if len(labels) > WIDEST:
        names = [q.name if q.unit == "–" else f"{q.name} [{q.unit}]" for q in page.quantities]
        below = zip(heads, *cells, strict=True) if cells else ()
        return _table("results", below)._replace(headers=("condition", *names))
    rows = [(q.name, q.unit, *own) for q, own in zip(page.quantities, cells, strict=True)]
    return _table("results", rows * bool(labels), behind=heads)


def _comparison(heading: str, rows: Iterable[Comparison], settings: ReportSettings) -> Table:
    cells = [
        (
            c.quantity,
            c.num_runs,
            markdown.number(c.median_difference),
            f"{c.better.a12:.3f} [{c.better.interval.low:.3f}, {c.better.interval.high:.3f}]",
            *map(markdown.p_value, (c.better.p_value, c.p_adjusted)),
        )
        for c in rows
    ]
    return _table("comparison", cells, heading=heading, level=100 * settings.confidence)


def _parameters(results: Results) -> Table:
    """Return one row per setting, and one per value where conditions differ in it."""
    by_name: dict[str, dict[Parameter, list[str]]] = {}
    for condition in results.conditions:
        for parameter in parameters(results, condition):
            by_name.setdefault(parameter.name, {}).setdefault(parameter, []).append(condition.label)
    every = [condition.label for condition in results.conditions]
    # settings group by group, seed and number of replicates last
    groups = list(dict.fromkeys(re.split(r"[.[]", name)[0] for name in by_name))
    groups.sort(key=lambda group: group in ("seed", "num_replicates"))
    ordered = sorted(by_name, key=lambda name: groups.index(re.split(r"[.[]", name)[0]))
    rows = [
        (
            f"`{name}`"
            + ("" if len(labels) == len(every) else f" ({in_few_words(labels, every)})"),
            parameter.value,
            parameter.unit or "–",
            parameter.source or "–",
        )
        for name in ordered
        for parameter, labels in by_name[name].items()
    ]
    return _table("parameters", rows)


def in_few_words(labels: Sequence[str], every: Sequence[str]) -> str:
    """Return some of every label of a page; a part stands for all labels that have it.

    "RRT" for "box · RRT, cage · RRT" if no other label has this part.
    """
    words, rest = list[str](), list(labels)
    for part in dict.fromkeys(part for label in labels for part in label.split(BETWEEN)):
        having = [label for label in every if part in label.split(BETWEEN)]
        if len(having) > 1 and set(having) <= set(labels) and set(having) & set(rest):
            words.append(part)
            rest = [label for label in rest if label not in having]
    return ", ".join((*words, *rest))
