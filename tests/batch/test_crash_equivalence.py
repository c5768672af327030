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


@pytest.mark.matrix
def test_blows_at_random_moments_over_all_planners(tmp_path: Path) -> None:
    """Strike a batch until enough blows met; each time it is complete, compare and begin anew."""
    words, directory = command(ALL, 4), tmp_path
    rng = random.Random(SEED)
    run_undisturbed(words, directory / "undisturbed")
    expected, all_logs = (
        masked_store(directory / "undisturbed"),
        num_logs(directory / "undisturbed"),
    )
    met = list[Blow]()
    for store in itertools.count():
        outputs, complete, since = directory / f"struck_{store}", False, len(met)
        while not complete and len(met) < NUM_BLOWS:
            blow = random_blow(rng, VICTIMS[len(met) % len(VICTIMS)], num_logs(outputs), all_logs)
            hit, complete = run_struck(words, outputs, blow)
            met += [blow] if hit else []
        if not complete:
            run_undisturbed(words, outputs)
        found = differing(expected, masked_store(outputs))
        assert found == [], f"after {met[since:]}"
        shutil.rmtree(outputs)
        if len(met) == NUM_BLOWS:
            return


def test_a_command_that_is_killed_at_half_of_its_logs_goes_on(tmp_path: Path) -> None:
    words = command(FEW, 12)
    run_undisturbed(words, tmp_path / "undisturbed")
    run_struck(words, tmp_path / "struck", Blow("group", 6, 0.0))
    run_undisturbed(words, tmp_path / "struck")
    expected = masked_store(tmp_path / "undisturbed")
    assert differing(expected, masked_store(tmp_path / "struck")) == []
