"""Kernels are warmed once per kind of condition, and what fails is left to the replicates."""

import time

import pytest

import evoexp.batch.warm_kernels as warm_kernels_module
from evoexp.batch.jobs import Job
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.warm_kernels import one_of_each_kind, warm_kernels
from evoexp.condition import Condition


def _job(condition: Condition, replicate: int = 0) -> Job:
    return Job(condition.id, condition.to_json(), replicate)


def test_conditions_that_differ_in_numbers_are_one_kind(
    faulty: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched, planner = [], type(faulty.planner)
    evolve = planner.evolve
    monkeypatch.setattr(
        planner, "evolve", lambda *given: (searched.append(given), evolve(*given))[1]
    )
    others = [faulty._replace(seed=seed) for seed in range(1, 4)]
    kinds = one_of_each_kind(_job(each, index) for each in [faulty, *others] for index in range(3))
    warm_kernels(kinds, ReplicateLimits())
    assert len(kinds) == len(searched) == 1


@pytest.mark.parametrize("fault", ["raise:0", "slow:0"])
def test_what_fails_or_takes_too_long_is_left_to_the_replicates(
    fault: str, faulty: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAULTY", fault)
    monkeypatch.setattr(warm_kernels_module, "COMPILING_S", 1.0)
    begun = time.monotonic()
    warm_kernels([_job(faulty)], ReplicateLimits(timeout_s=0.1))
    assert time.monotonic() - begun < 60.0
