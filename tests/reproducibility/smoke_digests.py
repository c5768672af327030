"""A process of its own: runs smoke-size conditions and prints their digests, under whatever environment it is given.

Also prints what the environment did (target of the compiler, features of numpy), so that a test can see that it acted.
"""

import argparse
import json

import numba
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_features__

from evoexp import compose
from evoexp.batch.runner import Job, fan_out
from evoexp.store.log_reader import read_log

EXPERIMENTS = ("rana_planar", "rana_obstacles")
NUM_REPLICATES = 3  # [-] an odd number, so that two workers cannot share alike


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--reverse", action="store_true", help="last condition and last replicate first")
    arguments = parser.parse_args()
    overrides = [f"experiment={','.join(EXPERIMENTS)}", "budget=smoke"]
    labelled = [row for experiment in compose.expand(overrides, multirun=True) for row in experiment.conditions]
    jobs = [Job(c.id, c.to_json(), replicate) for _, c in labelled for replicate in range(NUM_REPLICATES)]
    names = {condition.id: label for label, condition in labelled}
    digests = {}
    for outcomes in fan_out(jobs[::-1] if arguments.reverse else jobs, arguments.workers):
        for outcome in outcomes:
            assert not outcome.failed, outcome.traceback
            summary = read_log(outcome.content).summary
            digests[f"{names[outcome.condition_id]} #{outcome.replicate}"] = summary.digest
    report = {
        "digests": digests,
        "target": cpu_target.target_context.codegen().magic_tuple()[1:],
        "numpy_features": sorted(name for name, present in __cpu_features__.items() if present),
        "numba_threads": numba.config.NUMBA_NUM_THREADS,
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
