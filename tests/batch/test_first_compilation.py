"""Kernels are compiled once per kind of condition: of searches here, of verdicts in a worker."""

import pytest

from evoexp.batch import first_compilation
from evoexp.batch.first_compilation import compile_all, load_and_compile
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.paths.motion import Motion
from evoexp.planners import proofs


def test_kernels_are_compiled_once_for_conditions_that_differ_in_numbers(
    faulty: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted: set[str] = set()
    asked: list[bytes] = []
    from_json = Condition.from_json
    monkeypatch.setattr(first_compilation, "is_compiled", lambda kind, modules: kind in noted)
    monkeypatch.setattr(first_compilation, "note_compiled", lambda kind, modules: noted.add(kind))
    monkeypatch.setattr(
        Condition, "from_json", lambda text: (asked.append(text), from_json(text))[1]
    )
    texts = [faulty._replace(seed=seed).to_json() for seed in (0, 7, 12345)]
    compile_all([texts[0], *texts])
    assert asked == texts[:1]
    assert len(noted) == 1
    compile_all([b"{}"])  # no condition: nothing is noted, and it is asked again
    compile_all([b"{}"])
    assert asked[1:] == [b"{}", b"{}"]
    assert len(noted) == 1


@pytest.mark.parametrize("is_compiled", [False, True])
def test_a_worker_judges_motions_where_kernels_are_missing(
    faulty: Condition, monkeypatch: pytest.MonkeyPatch, is_compiled: bool
) -> None:
    judged: list[Motion] = []
    monkeypatch.setattr(first_compilation, "is_compiled", lambda kind, modules: is_compiled)
    monkeypatch.setattr(
        proofs, "judge_motion", lambda planner, problem, motion: judged.append(motion)
    )
    load_and_compile([faulty.to_json(), b"{}"])
    assert [motion.num_segments for motion in judged] == ([] if is_compiled else [20, 1])


def test_verdicts_follow_all_searches(faulty: Condition, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker compiles the kernels of verdicts meanwhile: nobody waits for them before."""
    steps: list[str] = []
    search, judge = first_compilation._search, first_compilation._judge
    monkeypatch.setattr(first_compilation, "is_compiled", lambda kind, modules: False)
    monkeypatch.setattr(first_compilation, "note_compiled", lambda kind, modules: None)
    monkeypatch.setattr(
        first_compilation, "_search", lambda kind: (steps.append("search"), search(kind))[1]
    )
    monkeypatch.setattr(
        first_compilation, "_judge", lambda *given: (steps.append("judge"), judge(*given))[1]
    )
    other = faulty.to_json().replace(b'"faulty"', b'"via_point_ga"')
    compile_all([faulty.to_json(), other])
    assert steps == ["search"] * 2 + ["judge"] * 4


def test_a_search_in_stages_is_followed_to_the_last_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else its kernels would never be known to be there, and be loaded by every command."""
    ((_, condition),) = expansions.expand(["experiment=chen_mission", "budget=smoke"])[
        0
    ].conditions[:1]
    noted: list[str] = []
    judged: list[Motion | None] = []
    monkeypatch.setattr(first_compilation, "is_compiled", lambda kind, modules: False)
    monkeypatch.setattr(
        first_compilation, "note_compiled", lambda kind, modules: noted.append(kind)
    )
    monkeypatch.setattr(
        proofs, "judge_motion", lambda planner, problem, motion: judged.append(motion)
    )
    compile_all([condition.to_json()])
    assert len(noted) == 1
    assert len(judged) == 4
    assert all(motion is not None for motion in judged)
