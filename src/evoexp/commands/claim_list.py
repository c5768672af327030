"""`evoexp claims`: the papers' claims, each with its rule, its numbers and its verdict."""

import argparse
from collections.abc import Iterator
from typing import Any

from rich.table import Column

from evoexp.commands.console import new_table, print_json, say
from evoexp.commands.report import request_of
from evoexp.configuration import compose
from evoexp.errors import NothingStored, UnknownOption
from evoexp.registry import CLAIMS, names, registered
from evoexp.report.pages.html_page import verdict_counts
from evoexp.report.pages.page_builder import page_of
from evoexp.report.statistics.judging import Rules, registered_rules
from evoexp.store.run_directory import outputs_root

_OF_CLAIM = ("name", "claim", "source", "rule", "evidence", "size", "n", "verdict")
OURS = "our question"  # the source of what no paper claims
PAPERS = names(CLAIMS)
KEYS = ("paper", *_OF_CLAIM, "experiment", "command")


def main(arguments: argparse.Namespace) -> int:
    """Print the claims that stored runs judge, then those that need a run."""
    papers: dict[str, Rules] = {}
    for paper in arguments.papers or names(CLAIMS):
        if (registration := registered(CLAIMS, paper)) is None:
            raise UnknownOption("paper", paper, names(CLAIMS))
        papers[paper] = registered_rules(registration)
    found = [row for paper, rules in papers.items() for row in claims_of(paper, rules)]
    if arguments.json:
        print_json(found)
        return 0
    for row in found:  # what is claimed, by which rule, from which numbers
        title = f"{row['paper']} · {row['experiment']} · {row['name'] or 'claim'}"
        table = new_table(title, Column(no_wrap=True), "")
        table.show_header = False
        for key in ("claim", "source", "verdict", "size", "evidence", "n", "rule", "command"):
            name = {"evidence": "numbers", "size": "decides"}.get(key, key)
            table.add_row(name, row[key] or "–")
        say(table)
        say("")
    ours = [row for row in found if row["source"].startswith(OURS)]
    for name, rows in (("claims", [r for r in found if r not in ours]), ("our questions", ours)):
        counts = verdict_counts(row["verdict"] for row in rows)
        words = ", ".join(f"{count} {verdict}" for verdict, count in counts)
        if rows:
            say(f"{name} ({len(rows)}): {words}")
    return 0


def claims_of(paper: str, rules: Rules) -> Iterator[dict[str, Any]]:
    """Yield the claims of a paper, experiment by experiment, with `KEYS`.

    A claim that is judged under every reading, by the experiment `<paper>_claims`, is yielded from
    there alone, and a sentence once, from the first experiment that judges it, which has all its
    conditions. Where a condition has no run, it names the command that runs its experiment.
    """
    known = set[str]()
    judged: dict[str, set[str]] = {}  # rule → identities of the conditions of its experiments
    experiments = dict.fromkeys(name for rule in rules.values() for name in rule.experiments)
    of_readings = f"{paper}_claims"
    for experiment in sorted(experiments, key=lambda name: name != of_readings):
        (expanded,) = compose.expand([f"experiment={experiment}"])
        ids = {condition.id for _, condition in expanded.conditions}
        own = [
            rule.name
            for rule in rules.values()
            if experiment == of_readings or of_readings not in rule.experiments
            if not ids <= judged.get(rule.name, set())
        ]
        try:
            request = request_of(expanded, [])
            results = request.results(outputs_root())
            if len(results.with_data) < len(results.conditions):
                raise NothingStored(experiment)  # of all conditions: claims compare them
            claims = page_of(results, request.settings).claims
            rows = [
                (c.name, c.text, c.source, c.rule, c.evidence, str(c.size or "–"), c.n, c.verdict)
                for c in claims
                if c.name in own or c.name not in rules
            ]
            command = f"evoexp report {experiment}"
            for name in own:
                if experiment in rules[name].experiments:
                    judged.setdefault(name, set()).update(ids)
        except NothingStored:
            waiting = [r.about() for r in rules.values() if experiment in r.experiments]
            rows = [
                (r.name, r.claim, r.source, r.text, "–", "–", "0", "not run")
                for r in waiting
                if r.name in own
            ]
            command = f"evoexp run experiment={experiment}"
        for row in rows:
            if row[1] in known:
                continue
            known.add(row[1])
            yield dict(zip(KEYS, (paper, *row, experiment, command), strict=True))
