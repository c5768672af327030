"""Tests notice small changes of the code: drawn ones, and those that were once overlooked.

`./scripts/test --exhaustive` tries them; `EVOEXP_MUTATION_SEED` draws others. A mutant that
survives shows a test that is missing. One that changes nothing is listed in `equivalent.toml`.
"""

import os
from pathlib import Path

import pytest
from mutant_trials import TRIAL_S, Trials
from mutants import Mutant, drawn, entries, mutants_of, plant

from matrix import EXHAUSTIVE

ROOT = Path(__file__).parents[2]
NUM_MUTANTS = 60
SEED = int(os.environ.get("EVOEXP_MUTATION_SEED", "39"))
DRAWN: list[Mutant] = []
if EXHAUSTIVE in os.environ:
    DRAWN += [plant(ROOT, row) for row in entries("plants")]
    DRAWN += drawn(ROOT, SEED, NUM_MUTANTS)


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Trials:
    return Trials(ROOT, tmp_path_factory.mktemp("mutants"))


@pytest.mark.exhaustive
@pytest.mark.timeout(3 * TRIAL_S)
@pytest.mark.parametrize("mutant", DRAWN, ids=lambda mutant: f"{mutant.file}:{mutant.line}")
def test_a_mutant_is_killed(mutant: Mutant, trials: Trials) -> None:
    outcome = trials.run(mutant)
    assert outcome.is_killed, f"{mutant} {outcome.text}"


@pytest.mark.parametrize("row", entries("plants"), ids=lambda row: row["name"])
def test_a_plant_fits_the_code(row: dict[str, str]) -> None:
    assert plant(ROOT, row).after != plant(ROOT, row).before


def test_equivalent_mutants_are_mutants_with_a_reason() -> None:
    for row in entries("equivalent"):
        source = (ROOT / row["file"]).read_text()
        changes = {(mutant.before, mutant.after) for _, mutant in mutants_of(row["file"], source)}
        assert (row["before"], row["after"]) in changes, row
        assert len(row["reason"]) > 10, row


def test_exit_codes_and_defaults_have_mutants_but_harmful_code_has_none() -> None:
    source = "def main(a: bool = True) -> int:\n    return 0\n"
    changed = {kind: mutant.applied(source) for kind, mutant in mutants_of("file.py", source)}
    assert changed == {
        "default": source.replace("True", "False"),
        "exit code": source.replace("0", "1"),
    }
    harmful = "def f(a: int = 1) -> None:\n    os.kill(-a, 9)\n"
    assert not list(mutants_of("file.py", harmful))
    assert not list(mutants_of("file.py", "raise ValueError(a[0])\nassert a < b"))


def test_a_seed_draws_the_same_mutants_of_all_rooms() -> None:
    mutants = drawn(ROOT, 1, 60)
    assert mutants == drawn(ROOT, 1, 60)
    assert mutants != drawn(ROOT, 2, 60)
    rooms = {path.parent.name for path in (ROOT / "src/evoexp").glob("*/__init__.py")} - {"assets"}
    assert rooms <= {Path(mutant.file).parts[2] for mutant in mutants}
    for mutant in mutants:
        compile(mutant.applied((ROOT / mutant.file).read_text()), mutant.file, "exec")
