"""A batch that was killed and asked for again stores the bytes of an undisturbed one.

All of them: of every log, every row, every other file; only the times of a replicate differ.
"""

import itertools
import random
import shutil
from pathlib import Path

import pytest
from killed_batches import (
    ALL,
    FEW,
    VICTIMS,
    Blow,
    command,
    num_logs,
    random_blow,
    run_struck,
    run_undisturbed,
)

from masked_logs import differing, masked_store
from matrix import counts

SEED = 20
NUM_BLOWS = counts(15, 50)  # with ./scripts/test --all

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="victims are found in /proc"
)


def strike(words: list[str], directory: Path, num_blows: int) -> None:
    """Strike a batch until so many blows met; each time it is complete, compare and begin anew."""
    rng = random.Random(SEED)
    run_undisturbed(words, directory / "undisturbed")
    expected, all_logs = (
        masked_store(directory / "undisturbed"),
        num_logs(directory / "undisturbed"),
    )
    met = list[Blow]()
    for store in itertools.count():
        outputs, complete, since = directory / f"struck_{store}", False, len(met)
        while not complete and len(met) < num_blows:
            blow = random_blow(rng, VICTIMS[len(met) % len(VICTIMS)], num_logs(outputs), all_logs)
            hit, complete = run_struck(words, outputs, blow)
            met += [blow] if hit else []
        if not complete:
            run_undisturbed(words, outputs)
        found = differing(expected, masked_store(outputs))
        assert found == [], f"after {met[since:]}"
        shutil.rmtree(outputs)
        if len(met) == num_blows:
            return


def test_one_blow_of_each_kind(tmp_path: Path) -> None:
    strike(command(FEW, 6), tmp_path, len(VICTIMS))


@pytest.mark.matrix
def test_blows_at_random_moments_over_all_planners(tmp_path: Path) -> None:
    strike(command(ALL, 4), tmp_path, NUM_BLOWS)
