"""A replicate that hangs or eats memory costs itself, and nothing else."""

import signal
import time
from pathlib import Path

import numpy as np
import pytest
from batch_samples import digests, run

from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.condition import Condition

LATE = "took longer than runner.timeout_s = 2"


def failures(outcomes: list) -> dict[int, str]:  # type: ignore[type-arg]
    return {outcome.replicate: outcome.reason for outcome in outcomes if outcome.reason}


def test_a_slow_replicate_fails_and_the_others_go_on(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FAULTY", "slow:1;slow_once:2")
    monkeypatch.setenv("FAULTY_FLAGS", str(tmp_path))
    begun = time.perf_counter()
    outcomes = run(tmp_path / "outputs", (faulty, 4), timeout_s=2.0)
    assert failures(outcomes) == {1: LATE}  # 2 is done at its second try
    assert time.perf_counter() - begun > 6.0  # three waits
    assert digests(tmp_path / "outputs", faulty) == {k: undisturbed[k] for k in (0, 2, 3)}


def test_workers_lose_nothing_but_what_hangs_or_eats_memory(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FAULTY", "slow:1;slow_once:4;deaf:6;eat:8")
    monkeypatch.setenv("FAULTY_FLAGS", str(tmp_path))
    settings = {"num_workers": 2, "timeout_s": 2.0, "memory_gb": 1.0}
    outcomes = run(tmp_path / "outputs", (faulty, 12), **settings)
    assert sorted(outcome.replicate for outcome in outcomes) == list(range(12)), "each ends once"
    found = failures(outcomes)
    assert found.pop(8).startswith(("MemoryError", "_ArrayMemoryError", "numpy._core"))
    assert found == {1: LATE, 6: f"{LATE}, in compiled code: its process was ended"}
    expected = {k: digest for k, digest in undisturbed.items() if k not in (1, 6, 8)}
    assert digests(tmp_path / "outputs", faulty) == expected


def test_what_is_in_time_is_left_alone() -> None:
    with limited(ReplicateLimits(0.2), in_worker=False):
        pass
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0), "nothing rings afterwards"


def test_what_takes_too_long_is_told_so() -> None:
    with (
        pytest.raises(TookTooLong, match=r"runner\.timeout_s = 0\.2$"),
        limited(ReplicateLimits(0.2), in_worker=False),
    ):
        signal.pause()


def test_memory_is_limited_in_workers_only() -> None:
    limits = ReplicateLimits(None, 10**8)
    with limited(limits, in_worker=False):
        assert np.ones(10**8, dtype=np.uint8).size == 10**8
    with pytest.raises(MemoryError), limited(limits, in_worker=True):
        np.ones(3 * 10**8, dtype=np.uint8)
    assert np.ones(3 * 10**8, dtype=np.uint8).size == 3 * 10**8
