"""A process of its own: runs conditions and prints their digests and summaries.

Under whatever environment it is given.

It also prints what the environment did to compiler, numpy and threads, so that a test can see that
it acted at all. Usage: smoke_digests.py FILE [--workers N] [--replicates N] [--reverse]
[--compose OVERRIDE …]; FILE holds a condition per line, the folder `files` beside it the files that
conditions refer to.
"""

import argparse
import json
import locale
from collections.abc import Iterable
from pathlib import Path
from typing import Any

NUM_REPLICATES = 3
TIMES = ("certificate_s", "cpu_s", "wall_s")
Job = tuple[bytes, int]


def main() -> None:
    locale.setlocale(locale.LC_ALL, "")  # as a program may that evoexp is a part of
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--workers", type=int, help="in worker processes; else here and without any runner"
    )
    parser.add_argument("--replicates", type=int, default=NUM_REPLICATES)
    parser.add_argument(
        "--reverse", action="store_true", help="last condition and last replicate first"
    )
    parser.add_argument(
        "--compose", nargs="*", help="print the conditions that these overrides give, too"
    )
    arguments = parser.parse_args()
    files = tuple(path.read_bytes() for path in (arguments.file.parent / "files").glob("*"))
    jobs = [
        (line, k)
        for line in arguments.file.read_bytes().splitlines()
        for k in range(arguments.replicates)
    ]
    ordered = jobs[::-1] if arguments.reverse else jobs
    found = (
        run_here(ordered, files)
        if arguments.workers is None
        else run_in_workers(ordered, files, arguments.workers)
    )
    rows = {f"{one.condition[:12]} #{one.replicate}": row(one) for one in found}
    report = {key: each["digest"] for key, each in rows.items()}
    composed = compose(arguments.compose) if arguments.compose else []
    print(json.dumps({"digests": report, "rows": rows, "composed": composed, **effects()}))


def run_here(jobs: list[Job], files: tuple[bytes, ...]) -> list[Any]:
    from evoexp.attachments import keep_all
    from evoexp.batch.replicate import run_replicate
    from evoexp.condition import Condition

    keep_all(files)
    return [run_replicate(Condition.from_json(config), k).summary for config, k in jobs]


def run_in_workers(jobs: list[Job], files: tuple[bytes, ...], num_workers: int) -> Iterable[Any]:
    from evoexp.attachments import keep_all
    from evoexp.batch.fan_out import fan_out
    from evoexp.batch.jobs import Job as Task
    from evoexp.batch.workers import Workers
    from evoexp.condition import Condition
    from evoexp.store.log_reader import read_log

    keep_all(files)
    tasks = [Task(Condition.from_json(config).id, config, k, files) for config, k in jobs]
    with Workers(num_workers) as workers:
        for outcomes in fan_out(tasks, workers):
            for outcome in outcomes:
                assert not outcome.reason, outcome.traceback
                yield read_log(outcome.content).summary


def row(summary: Any) -> dict[str, Any]:
    """Return a summary without its times, floats to the last bit."""
    from evoexp.records import flatten

    return {
        name: value.hex() if isinstance(value, float) else value
        for name, value in flatten(summary).items()
        if name not in TIMES
    }


def compose(overrides: list[str]) -> list[str]:
    from evoexp.configuration.compose import expand

    found = [
        labelled
        for experiment in expand(overrides, multirun=True)
        for labelled in experiment.conditions
    ]
    return [labelled.condition.to_json().decode() for labelled in found]


def effects() -> dict[str, Any]:
    import numba
    from numba.core.registry import cpu_target
    from numpy._core._multiarray_umath import __cpu_features__

    from evoexp.store.manifest import environment

    return {
        "versions": environment()["versions"],
        "cpu": cpu_target.target_context.codegen().magic_tuple()[1:],
        "numpy_features": [name for name, present in __cpu_features__.items() if present],
        "decimal_point": locale.localeconv()["decimal_point"],
        "numba_threads": numba.config.NUMBA_NUM_THREADS,
        "hash": hash("evoexp"),
    }


if __name__ == "__main__":
    main()
