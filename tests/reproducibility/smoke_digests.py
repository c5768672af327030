"""A process of its own: runs conditions in workers and prints their summaries.

Under whatever environment it is given. Usage: smoke_digests.py FILE --workers N [--replicates N]
[--compose OVERRIDE …]; FILE holds a condition per line, the folder `files` beside it the files that
conditions refer to. The conditions that the overrides give are printed, too.
"""

import argparse
import json
import locale
from pathlib import Path
from typing import Any

from evoexp.attachments import keep_all
from evoexp.batch.jobs import Job, fan_out
from evoexp.batch.workers import Workers
from evoexp.condition import Condition
from evoexp.configuration.compose import expand
from evoexp.records import flatten
from evoexp.store.log_reader import read_log

TIMES = ("certificate_s", "cpu_s", "wall_s")


def main() -> None:
    locale.setlocale(locale.LC_ALL, "")  # as a program may that evoexp is a part of
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument("--workers", type=int, required=True)
    parser.add_argument("--replicates", type=int, default=1)
    parser.add_argument("--compose", nargs="*", default=[])
    arguments = parser.parse_args()
    files = tuple(path.read_bytes() for path in (arguments.file.parent / "files").glob("*"))
    keep_all(files)
    jobs = [
        Job(Condition.from_json(line).id, line, k, files)
        for line in arguments.file.read_bytes().splitlines()
        for k in range(arguments.replicates)
    ]
    rows = {}
    with Workers(arguments.workers) as workers:
        for outcome in (each for bundle in fan_out(jobs, workers) for each in bundle):
            assert not outcome.reason, outcome.traceback
            summary = read_log(outcome.content).summary
            rows[f"{summary.condition[:12]} #{summary.replicate}"] = row(summary)
    experiments = expand(arguments.compose, multirun=True) if arguments.compose else []
    composed = [c.to_json().decode() for each in experiments for _, c in each.conditions]
    print(json.dumps({"rows": rows, "composed": composed}))


def row(summary: Any) -> dict[str, Any]:
    """Return a summary without its times, floats to the last bit."""
    return {
        name: value.hex() if isinstance(value, float) else value
        for name, value in flatten(summary).items()
        if name not in TIMES
    }


if __name__ == "__main__":
    main()
