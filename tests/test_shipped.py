"""The shipped table tells the truth, and `reproduce` answers from it where nothing was ever run."""

from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from composed import composed, script
from evoexp import shipped
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import fingerprint, same_fingerprint
from evoexp.cli import main
from evoexp.condition import Condition
from evoexp.configuration.search_path import options
from evoexp.shipped import Shipped
from matrix import matrices_are_asked_for
from shipped_conditions import EXAMPLES, KINDS, expanded, kinds_of_conditions, shipped_conditions

ROOT = Path(__file__).parents[1]
TABLE = shipped.shipped()
BUDGETS = ("paper", "smoke")
MATRIX = pytest.mark.matrix
UPDATE = "then run scripts/update-shipped and commit the table"


SMALL = {  # rows of an experiment that is composed and run in tenths of a second
    budget: [row for row in TABLE if (row.experiment, row.budget) == ("rana_planar", budget)]
    for budget in BUDGETS
}


@pytest.fixture
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Outputs in which nothing was ever run."""
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "outputs"))
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path / "outputs"


@pytest.mark.matrix
def test_every_shipped_condition_is_in_the_table_and_nothing_else() -> None:
    assert len(TABLE) == len(set(TABLE))
    composed = {
        (*key, budget): condition.id
        for budget in BUDGETS
        for key, condition in shipped_conditions(budget).items()
    }
    assert {row[:3]: row.condition_id for row in TABLE} == composed, (
        f"a shipped condition was added, removed or changed: if that was meant, {UPDATE}"
    )


@pytest.mark.matrix
@pytest.mark.parametrize("budget", BUDGETS)
def test_kinds_of_conditions_are_as_many_as_tests_are_collected_for(budget: str) -> None:
    assert len(kinds_of_conditions(budget)) == len(KINDS), "correct KINDS in shipped_conditions.py"


def condition_of(row: Shipped) -> Condition:
    if matrices_are_asked_for():  # for every row of the experiment
        return dict(expanded(row.experiment, row.budget).conditions)[row.label]
    return composed(f"experiment={row.experiment}", f"budget={row.budget}", label=row.label)


SMOKE = [
    pytest.param(row, id=f"{row.experiment}: {row.label}", marks=() if is_example else MATRIX)
    for row in TABLE
    if (is_example := row.experiment in dict(EXAMPLES)) or matrices_are_asked_for()
    if row.budget == "smoke"
]


@pytest.mark.parametrize("row", [*SMOKE, SMALL["paper"][0]])
def test_smoke_digests(row: Shipped) -> None:
    """And one of a paper's budget."""
    condition = condition_of(row)
    meant = f"if that was meant, {UPDATE}"
    assert condition.id == row.condition_id, f"the condition itself changed: {meant}"
    found = fingerprint(condition, run_replicate(condition, 0).summary)
    assert same_fingerprint(found, row.digest), (
        f"{row.experiment}, {row.label}, {row.budget}: the same settings give another result than "
        "before. If that was not meant, find out why; else raise `revision` of the component "
        f"whose results changed, {UPDATE}"
    )


def test_a_raised_revision_is_another_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    condition = Condition.from_json(condition_of(TABLE[0]).to_json())  # not the one that is kept
    before = condition.id
    monkeypatch.setattr(type(condition.scenario), "revision", 99)
    assert condition.id != before


# ----------------------------------------------------------------- reproduce, where nothing was run


@pytest.mark.parametrize("row", [*SMALL["smoke"][:2], *SMALL["paper"][:1]])
def test_a_shipped_hash_matches_the_table(
    row: Shipped, nowhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reproduce", row.condition_id[:9]]) == 0
    printed = capsys.readouterr().out
    assert "against the shipped table: MATCH" in printed
    assert any(o.command in printed for o in TABLE if o.condition_id == row.condition_id)
    assert main(["reproduce", row.condition_id.upper(), "--replicate", "0"]) == 0
    assert not nowhere.exists()


def test_another_digest_diverges(
    nowhere: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    row = SMALL["smoke"][0]
    monkeypatch.setattr(shipped, "shipped", lambda: (row._replace(digest="0" * 32),))
    assert main(["reproduce", row.condition_id[:9]]) == 1
    assert "DIVERGES" in capsys.readouterr().out


@pytest.mark.parametrize(
    "what", [[TABLE[0].condition_id[:9], "--replicate", "3"], ["0123456789abcdef"], ["rana"]]
)
def test_nothing_to_compare(
    what: list[str], nowhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reproduce", *what]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("evoexp: NOTHING TO COMPARE: ")
    assert what[0] in printed.err and printed.err.count("\n") == 1
    assert "MATCH" not in printed.out + printed.err


def test_a_hash_is_found_once_in_the_smallest_experiment_that_has_it() -> None:
    sizes = Counter((row.experiment, row.budget) for row in TABLE)
    found = {row.condition_id: row for row in shipped.find("")}
    assert len(shipped.find("")) == len(found) == len({row.condition_id for row in TABLE})
    shared = [row for row in TABLE if found[row.condition_id] != row]
    assert shared
    for row in shared:
        smallest = found[row.condition_id]
        assert sizes[smallest.experiment, smallest.budget] <= sizes[row.experiment, row.budget]


# --------------------------------------------------------------------------- scripts/update-shipped


@pytest.fixture
def update(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, str]]:
    """Have the script write a copy of the table of some rows; return its exit code and the copy."""
    module = script("update-shipped")
    monkeypatch.setattr(module, "TABLE", tmp_path / "shipped.json")
    module.TABLE.write_text("untouched")

    def run(rows: Iterable[Shipped], *words: str) -> tuple[int, str]:
        names = [word for word in words if not word.startswith("-")] or options("experiment")
        answers = {tuple(names): list(rows)}
        monkeypatch.setattr(module, "rows", lambda asked: answers[tuple(asked)])
        return module.main(list(words)), module.TABLE.read_text(encoding="utf-8")

    return run


OTHER = TABLE[0]._replace(condition_id="f" * 64, digest="0" * 32)
Update = Callable[..., tuple[int, str]]


def test_update_writes_the_table_and_keeps_the_rows_of_other_experiments(update: Update) -> None:
    stored = (ROOT / "src/evoexp/assets/shipped.json").read_text(encoding="utf-8")
    assert update(TABLE) == (0, stored)
    assert sorted(TABLE) == list(TABLE)
    own = [row for row in TABLE if row.experiment == TABLE[0].experiment]
    assert update([OTHER, *own[1:]], TABLE[0].experiment) == update([OTHER, *TABLE[1:]])


def test_update_refuses_another_digest_under_the_same_hash(
    update: Update, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = TABLE[0]._replace(digest="0" * 32)
    assert update([changed, *TABLE[1:]]) == (1, "untouched")
    printed = capsys.readouterr().out
    digests = f"digest {TABLE[0].digest} → {'0' * 32}"
    assert f"hash {TABLE[0].condition_id[:12]} as before, {digests}" in printed
    assert "raise `revision` of the component" in printed
    code, written = update([changed, *TABLE[1:]], "--force")
    assert code == 0 and "0" * 32 in written


def test_update_takes_a_new_hash_and_says_so(
    update: Update, capsys: pytest.CaptureFixture[str]
) -> None:
    assert update([OTHER, *TABLE[2:]])[0] == 0
    printed = capsys.readouterr().out
    assert f"{', '.join(TABLE[0][:3])}: {TABLE[0].condition_id[:12]} → ffffffffffff" in printed
    assert f"{', '.join(TABLE[1][:3])}: {TABLE[1].condition_id[:12]} → gone" in printed
