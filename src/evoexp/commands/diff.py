"""`evoexp diff A B`: two stored runs beside each other: settings, environment, results."""

import argparse
import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.commands import stored_runs
from evoexp.commands.console import new_table, print_json, say
from evoexp.errors import UnknownHash, printable
from evoexp.records import TIMES
from evoexp.store.identity import TAKEN, changed, differences, typed_parts
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table

ABSENT = "–"
QUANTITIES = ("best_cost", "evaluations", "collision_queries", "clearance", "cpu_s")
ORIGIN = ("condition", "experiment", "label", "budget", "options", "command", "git", TAKEN)
KEYS = ("a", "b", "settings", "environment", "results", "same_replicates")


class Side(NamedTuple):
    """A condition, with its run where it was run here."""

    condition_id: str  # 64 hex digits
    settings: dict[str, Any]  # its canonical form as plain data
    manifest: dict[str, Any] | None  # environment of its run; None: it was not run here
    rows: dict[int, dict[str, Any]]  # its replicates, done ones only
    head: str  # of its column: hash, and the archive it is in


def main(arguments: argparse.Namespace) -> int:
    """Compare; exit code as that of `diff`: 0 nothing differs, 1 something, 2 cannot be compared.

    Times differ always and do not count.
    """
    one, two = _side(arguments.a), _side(arguments.b)
    settings = list(changed(typed_parts(one.settings), typed_parts(two.settings)))
    environment = _environment(one, two)
    names = dict.fromkeys(k for side in (one, two) for row in side.rows.values() for k in row)
    terms = [name for name in names if name.startswith("term_")]
    medians = [_results(side.rows.values(), terms) for side in (one, two)]
    results = [(name, value, medians[1][name]) for name, value in medians[0].items()]
    common = sorted(one.rows.keys() & two.rows.keys())
    same = [k for k in common if _measured(one.rows[k]) == _measured(two.rows[k])]
    if arguments.json:
        values = (one.condition_id, two.condition_id, settings, environment, results, same)
        print_json(dict(zip(KEYS, values, strict=True)))
    else:
        heads = one.head, two.head
        _print("settings", heads, settings)
        if one.manifest is not None and two.manifest is not None:
            _print("environment", heads, environment)
        _print("results: median over replicates", heads, results)
        if common:
            say(f"{len(same)} of {len(common)} common replicates are the same, bit for bit")
    other = len(same) < len(common) or one.rows.keys() != two.rows.keys()
    return 1 if settings or environment or other else 0


def _side(prefix: str) -> Side:
    if packed := stored_runs.in_archive(prefix):
        with stored_runs.looked_into(*packed) as runs:
            if len(runs) > 1:
                choices = ", ".join(f"{prefix}:{run.hash12}" for run in runs[: stored_runs.NAMED])
                raise UnknownHash(f"{prefix}: holds {len(runs)} runs; choose one: {choices}")
            side = _stored(runs[0])
            return side._replace(head=f"{printable(packed[0].name)}\n{side.head}")
    run = stored_runs.stored_or_shipped(prefix)
    if isinstance(run, RunDirectory):
        return _stored(run)
    condition = stored_runs.shipped_experiment(run).conditions[0].condition
    return Side(condition.id, json.loads(condition.to_json()), None, {}, run.condition_id[:12])


def _stored(run: RunDirectory) -> Side:
    table = summary_table(run).to_pylist()
    rows = {int(row["replicate"]): row for row in table if row["status"] == "done"}
    return Side(run.condition_id, json.loads(run.config_json()), run.manifest(), rows, run.hash12)


def _measured(row: Mapping[str, Any]) -> str:
    """Return a replicate's row as text, to the last bit; without condition and times."""
    return repr({k: v for k, v in row.items() if k not in (*TIMES, "condition") and v is not None})


def _environment(one: Side, two: Side) -> list[tuple[str, Any, Any]]:
    if one.manifest is None or two.manifest is None:
        return []
    code = [{"git": manifest.get("git")} for manifest in (one.manifest, two.manifest)]
    return [
        *(d for d in differences(one.manifest, two.manifest) if d.name.split(".")[0] not in ORIGIN),
        *changed(*code),
    ]


def _results(rows: Collection[Mapping[str, Any]], terms: Sequence[str]) -> dict[str, Any]:
    """Return the counts of a run's replicates, and the medians of their quantities and terms."""
    counts = {name: sum(row[name] is True for row in rows) for name in ("solved", "certified")}
    results: dict[str, Any] = {"replicates": len(rows), **counts}
    for name in (*QUANTITIES, *terms):
        values = [row[name] for row in rows if row.get(name) is not None]
        results[name.removeprefix("term_")] = float(np.median(values)) if values else None
    return results


def _print(title: str, heads: tuple[str, str], rows: list[tuple[str, Any, Any]]) -> None:
    if not rows:
        say(f"{title}: the same")
        return
    say(new_table(title, "", *heads, rows=((name, _text(a), _text(b)) for name, a, b in rows)))


def _text(value: Any) -> str:
    if value is None:
        return ABSENT
    if isinstance(value, float):
        return f"{value:.6g}"
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 200 else f"{text[:200]}…"
