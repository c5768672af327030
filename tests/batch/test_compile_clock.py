"""Times of a replicate hold neither the compilation nor the loading of kernels."""

import time

import pytest
from numba.core.compiler_lock import global_compiler_lock

from evoexp.batch import compile_clock, replicate
from evoexp.batch.compile_clock import Times, cpu_now, now
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition

HELD_S = 5.0  # [s] by which the clocks of the test go on at once


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Let the clocks show the sum of a list."""
    passed = [0.0]
    monkeypatch.setattr(compile_clock, "_processor_time", lambda: sum(passed))
    monkeypatch.setattr(compile_clock, "_clocks", lambda: Times(sum(passed), 2.0 * sum(passed)))
    return passed


def test_time_under_the_compilers_lock_does_not_pass(clocks: list[float]) -> None:
    begun, cpu_begun = now(), cpu_now()
    clocks.append(1.0)
    with global_compiler_lock:
        clocks.append(HELD_S)
        with global_compiler_lock:  # a kernel that calls another
            clocks.append(HELD_S)
        clocks.append(HELD_S)
    clocks.append(2.0)
    assert now() - begun == pytest.approx(Times(3.0, 6.0))
    assert cpu_now() - cpu_begun == pytest.approx(3.0)


def test_a_replicate_that_compiles_takes_no_longer(
    faulty: Condition, clocks: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is compiled while it runs, in the search and in the judgement of its motion."""
    judge = replicate.judge_motion
    evolve = type(faulty.planner).evolve

    def compiles(function):  # type: ignore[no-untyped-def]
        def slower(*arguments):  # type: ignore[no-untyped-def]
            clocks.append(1.0)
            with global_compiler_lock:
                clocks.append(HELD_S)
            return function(*arguments)

        return slower

    monkeypatch.setattr(replicate, "judge_motion", compiles(judge))
    monkeypatch.setattr(type(faulty.planner), "evolve", compiles(evolve))
    _, summary = run_replicate(faulty, 0)
    assert summary.cpu_s == pytest.approx(2.0)
    assert summary.wall_s == pytest.approx(4.0)
    assert summary.certificate_s == pytest.approx(1.0)


def test_the_clocks_are_those_of_the_process() -> None:
    before = time.process_time(), time.perf_counter()
    read = compile_clock._clocks()
    after = time.process_time(), time.perf_counter()
    assert before[0] <= read.cpu_s <= after[0]
    assert before[1] <= read.wall_s <= after[1]
