"""Pairs of bodies out of the cache are those that are sorted anew."""

from pathlib import Path

import pytest

from evoexp.collision.models import kept_pairs
from evoexp.collision.models.body_models import BodyCapsules, BodyModel
from shipped_conditions import expanded


def test_kept_pairs_are_those_that_were_sorted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    robot = expanded("corsepius_shelf", "paper").conditions[0].condition.robot
    assembly, model = robot.build(), BodyCapsules(padding=0.0)
    expected = model.bind(assembly).sorted_pairs
    assert expected.tested
    assert expected.never

    sorting, times = kept_pairs.body_pairs, list[int]()
    monkeypatch.setattr(kept_pairs, "body_pairs", lambda *given: times.append(1) or sorting(*given))

    def bound(made_from: bytes) -> BodyModel:
        return model.bind(assembly, made_from)

    assert bound(b"puma").sorted_pairs == expected
    assert bound(b"puma").sorted_pairs == expected
    assert len(times) == 1
    assert bound(b"another").sorted_pairs == expected
    assert len(times) == 2
    for file in (tmp_path / "cache/facts").iterdir():
        file.write_bytes(b"damaged")
    assert bound(b"puma").sorted_pairs == expected
    assert len(times) == 3
