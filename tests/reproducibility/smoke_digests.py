"""A process of its own: runs conditions and prints their digests.

Under whatever environment it is given.

It also prints what the environment did to compiler, numpy and threads, so that a test can see that
it acted at all. Usage: smoke_digests.py FILE [--workers N] [--reverse] [--compose OVERRIDE …]; FILE
holds a condition per line.
"""

import argparse
import json
from pathlib import Path
from typing import Any

NUM_REPLICATES = 3


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--workers", type=int, help="in worker processes; else here and without any runner"
    )
    parser.add_argument(
        "--reverse", action="store_true", help="last condition and last replicate first"
    )
    parser.add_argument(
        "--compose", nargs="*", help="print the conditions that these overrides give, too"
    )
    arguments = parser.parse_args()
    jobs = [
        (line, k)
        for line in arguments.file.read_bytes().splitlines()
        for k in range(NUM_REPLICATES)
    ]
    ordered = jobs[::-1] if arguments.reverse else jobs
    report = (
        run_here(ordered)
        if arguments.workers is None
        else run_in_workers(ordered, arguments.workers)
    )
    composed = compose(arguments.compose) if arguments.compose else []
    print(json.dumps({"digests": report, "composed": composed, **effects()}))


def run_here(jobs: list[tuple[bytes, int]]) -> dict[str, str]:
    from evoexp.batch.replicate import run_replicate
    from evoexp.condition import Condition

    summaries = [run_replicate(Condition.from_json(config), k).summary for config, k in jobs]
    return {
        f"{summary.condition[:12]} #{summary.replicate}": summary.digest for summary in summaries
    }


def run_in_workers(jobs: list[tuple[bytes, int]], num_workers: int) -> dict[str, str]:
    from evoexp.batch.runner import Job, fan_out
    from evoexp.condition import Condition
    from evoexp.store.log_reader import read_log

    found = {}
    for outcomes in fan_out(
        [Job(Condition.from_json(config).id, config, k) for config, k in jobs], num_workers
    ):
        for outcome in outcomes:
            assert not outcome.failed, outcome.traceback
            found[f"{outcome.condition_id[:12]} #{outcome.replicate}"] = read_log(
                outcome.content
            ).summary.digest
    return found


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

    return {
        "cpu": cpu_target.target_context.codegen().magic_tuple()[1:],
        "numpy_features": [name for name, present in __cpu_features__.items() if present],
        "numba_threads": numba.config.NUMBA_NUM_THREADS,
        "hash": hash("evoexp"),
    }


if __name__ == "__main__":
    main()
