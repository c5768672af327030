"""Budgets in collision queries: a part of the identity, and a prefix of the run without a cap."""

import pytest

from evoexp.batch.replicate import BUDGET_SPENT, run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import SettingError
from evoexp.store.log_reader import LogContents, read_log

FEW = ("ga.num_generations=30", "num_replicates=1")


def condition(*words: str, label: str = "via-point GA") -> Condition:
    (experiment,) = compose.expand(["experiment=rana_planar", *FEW, *words])
    return next(each.condition for each in experiment.conditions if each.label == label)


def log(chosen: Condition) -> LogContents:
    return read_log(run_replicate(chosen, 0).content)


@pytest.mark.parametrize("label", ["via-point GA", "random search", "multi-start"])
@pytest.mark.parametrize("most", [1000, 9000, 9001, 20_000])
def test_a_capped_run_is_the_beginning_of_the_uncapped_one(label: str, most: int) -> None:
    whole = log(condition(label=label))
    capped = log(condition(f"budget.collision_queries={most}", label=label))
    kept = [row for row in whole.generations if row.collision_queries <= most]
    assert 0 < len(kept) < len(whole.generations)
    assert [row.chain for row in capped.generations] == [row.chain for row in kept]
    assert capped.summary.stop_reason == BUDGET_SPENT
    assert capped.summary.collision_queries == kept[-1].collision_queries
    assert capped.summary.digest != whole.summary.digest
    assert whole.summary.stop_reason == "generations"


def test_a_cap_that_is_never_reached_changes_the_hash_alone() -> None:
    free, capped = condition(), condition("budget.collision_queries=1e9")
    assert capped.id != free.id
    assert b"max_collision_queries" not in free.to_json()
    whole, same = log(free), log(capped)
    assert [row.chain for row in same.generations] == [row.chain for row in whole.generations]
    assert same.summary.stop_reason == "generations"


def test_caps_are_whole_numbers_as_one_types_them() -> None:
    chosen = condition("budget.collision_queries=2e4")
    assert chosen.max_collision_queries == 20_000
    assert Condition.from_json(chosen.to_json()) == chosen
    assert condition("budget.collision_queries=20000").id == chosen.id
    assert condition("budget.collision_queries=null").id == condition().id


@pytest.mark.parametrize("wrong", [b"0", b"true", b'"7"', b"7.0"])
def test_a_stored_cap_is_checked(wrong: bytes) -> None:
    text, name = condition("budget.collision_queries=7").to_json(), b'"max_collision_queries":'
    assert name + b"7" in text
    with pytest.raises(SettingError, match="max_collision_queries: must be a whole number"):
        Condition.from_json(text.replace(name + b"7", name + wrong))


def test_a_cap_below_the_initial_population_is_one_line() -> None:
    must = r"budget\.collision_queries: must be at least what the initial population asks for"
    with pytest.raises(SettingError, match=must + r" \(1,000\), was 999"):
        run_replicate(condition("budget.collision_queries=999"), 0)
