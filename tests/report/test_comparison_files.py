"""Files that a comparison takes and gives: best known lengths, given runs."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from composed import script
from evoexp.errors import EvoexpError, SettingError
from evoexp.report.figures.effort_curves import length_table, share_table
from evoexp.report.pages import comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.comparison_files import (
    COLUMNS,
    BestKnown,
    GivenData,
    of_given,
    parsed,
    read_best_known,
    read_given,
    shipped_best_known,
    strange_problems,
)
from evoexp.report.results.planner_runs import MULTIPLES, of_results, problem_key
from evoexp.report.results.stored_results import Results

ONE = BestKnown(problem='a "quoted": name', length=1.0 / 3.0, run="0123456789ab", replicate=7)
TWO = BestKnown(problem="λ", length=2.0, run="111111111111", replicate=0)
KNOWN = {"123456789012": ONE, "00000000001e": TWO}  # keys that YAML would take for numbers


@pytest.fixture
def update() -> Any:
    return script("update-best-known")


def test_what_is_written_is_read(update: Any) -> None:
    for entries in (KNOWN, {}, shipped_best_known()):
        assert parsed(update.to_yaml(entries), "x") == entries
    assert parsed(b"", "x") == {}
    text = (Path(__file__).parents[2] / "src/evoexp/assets/best_known.yaml").read_bytes()
    assert text == update.to_yaml(shipped_best_known())


REFUSED: dict[str, dict[str, str]] = yaml.safe_load(
    Path(__file__).with_name("refused_data.yaml").read_text(encoding="utf-8")
)


@pytest.mark.parametrize(("text", "said"), REFUSED["best_known"].items())
def test_what_cannot_be_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(EvoexpError) as caught:
        read_best_known(path)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_only_shorter_lengths_are_put_in(update: Any) -> None:
    found = {
        "123456789012": ONE.model_copy(update={"length": 0.5}),
        "00000000001e": TWO.model_copy(update={"problem": "other", "length": 1.5, "replicate": 3}),
        "abcdefabcdef": TWO,
    }
    now, lines = update.lowered(KNOWN, found)
    shorter = TWO.model_copy(update={"length": 1.5, "replicate": 3})  # its name stays
    assert now == {"123456789012": ONE, "00000000001e": shorter, "abcdefabcdef": TWO}
    assert lines == ["λ (00000000001e): 2 → 1.5", "λ (abcdefabcdef): new → 2"]
    assert update.lowered(now, found) == (now, [])


def test_targets_are_multiples_of_the_best_known_not_of_the_best_here(
    results: Results, settings: ReportSettings
) -> None:
    plain = of_results(results.evolved)
    key, straight = plain[0].problem.key, plain[0].problem.straight
    known = of_results(results.evolved, {key: 0.7 * straight, "other": 1.0})
    one = of_results(results.evolved[:1], {key: 0.7 * straight})  # whoever is compared
    for runs, length in ((plain, straight), (known, 0.7 * straight), (one, 0.7 * straight)):
        targets = tuple(m * length for m in MULTIPLES)
        assert {own.problem.targets for own in runs} == {targets}
    low, high = (share_table(runs)["share"].astype(float).max() for runs in (known, plain))
    assert low <= high
    for runs, words in ((plain, "straight line"), (known, "best known")):
        row = comparison.page(results, settings, runs).tables[0].rows[0]
        assert (row[1], row[-1]) == (f"`{key}`", words)


def test_the_script_writes_what_the_store_has_of_these_problems(
    update: Any,
    stored: Path,
    results: Results,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    file, runs = tmp_path / "known.yaml", of_results(results.evolved)
    assert update.main(["rana_planar", "--file", str(file)]) == 0  # runs of another budget, there
    ((key, best),) = read_best_known(file).items()
    assert key == problem_key(results.evolved[0].condition) and best.problem != best.run
    assert best.length == min(own.best_lengths.min() for own in runs)
    (own,) = (own for own in runs if own.condition and own.condition.run.hash12 == best.run)
    assert own.best_lengths[own.replicates.index(best.replicate)] == best.length
    assert f"({key}): new → " in capsys.readouterr().out
    before = file.read_bytes()
    assert update.main(["rana_planar", "--file", str(file)]) == 0
    assert "nothing is shorter" in capsys.readouterr().out and file.read_bytes() == before
    with pytest.raises(SystemExit):
        update.main(["rana_planer"])
    assert "did you mean 'rana_planar'?" in capsys.readouterr().err


HEAD, SEMICOLONS = ",".join(COLUMNS), ";".join(COLUMNS)


ROWS = f"""{HEAD}
RRT*,link_motion,7,50,9.0
RRT*,link_motion,7,400,5.0
RRT*,link_motion,3,900,
"my, own",elsewhere,0,10,1.5
"my, own",elsewhere,0,99,
"""


def given(tmp_path: Path, problem: str = "link_motion", text: str = ROWS) -> GivenData:
    """Read a file of two planners: one on our problem, with a run that failed."""
    path = tmp_path / "given.csv"
    path.write_text(text.replace("link_motion", problem), newline="")
    return read_given(str(path))


def test_given_runs_are_those_of_the_file(tmp_path: Path, results: Results) -> None:
    ours = of_results(results.evolved)
    name = ours[0].problem.name
    found = of_given(given(tmp_path, name), ours)
    planners = [(own.planner, own.problem.name) for own in found]
    assert planners == [("RRT* (given)", name), ("my, own (given)", "elsewhere")]
    tree, other = found
    assert tree.problem == ours[0].problem and tree.replicates == (3, 7)
    assert tree.best_lengths.tolist() == [math.inf, 5.0]
    for most, efforts in ((math.inf, [900.0, 50.0]), (6.0, [900.0, 400.0])):
        assert [part.tolist() for part in tree.first_reached(most)] == [efforts, [False, True]]
    assert (other.problem.key, other.problem.targets) == ("", MULTIPLES[:1])
    assert other.spent.tolist() == [99.0] and other.best_lengths.tolist() == [1.5]
    counts = share_table([*ours, *found]).groupby("planner")["targets"].first()
    assert counts["RRT* (given)"] == 2 * len(MULTIPLES) and counts["my, own (given)"] == 1


def test_a_problem_is_called_by_its_name_a_label_or_its_key(
    tmp_path: Path, results: Results
) -> None:
    ours = of_results(results.evolved)
    problem, label = ours[0].problem, ours[1].label
    for called in (problem.name, label, problem.key):
        data = given(tmp_path, called)
        assert of_given(data, ours)[0].problem == problem
        assert [line.split("'")[1] for line in strange_problems(data, ours)] == ["elsewhere"]
    wrong, *_ = strange_problems(given(tmp_path, label[:-1].lower()), ours)
    assert f"did you mean '{label}'?" in wrong


def test_the_page_marks_given_planners(
    tmp_path: Path, results: Results, settings: ReportSettings
) -> None:
    ours, data = of_results(results.evolved), given(tmp_path)
    page = comparison.page(results, settings, [*ours, *of_given(data, ours)], data)
    assert data.sha256[:12] in page.introduction and "(given)" in page.introduction
    last = page.tables[1].rows[-1]
    assert last[0] == "elsewhere: my, own (given)" and last[-1] == "–"
    assert not any("given" in row.quantity for _, rows in page.comparisons for row in rows)
    assert math.isfinite(float(str(last[4]).split(" ")[0]))


def test_a_planner_without_any_answer_does_not_widen_the_axis(
    tmp_path: Path, results: Results
) -> None:
    ours = of_results(results.evolved)
    data = given(tmp_path, text=f"{HEAD}\nnever,{ours[0].problem.name},0,90000,\n")
    table = length_table([*ours, *of_given(data, ours)])
    first = min(float(own.table["collision_queries"].min()) for own in ours if len(own.table))
    assert table["collision_queries"].min() == pytest.approx(first)
    assert np.isinf(table[table["planner"] == "never (given)"]["median"]).all()


ROWS_REFUSED = {f"{HEAD}\n{rows}": said for rows, said in REFUSED["rows"].items()}


@pytest.mark.parametrize(("text", "said"), [*ROWS_REFUSED.items(), *REFUSED["files"].items()])
def test_a_bad_row_is_named_by_line_and_column(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(SettingError, match=f"^given.csv.*{said.replace('(', '[(]')}") as caught:
        given(tmp_path, text=text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "queries", "costs"),
    [
        (f"{HEAD}\nA,p,0,1e3,1.5\nA,p,1.0,12.0,inf\nA,p,2,1.5e1,Inf\n", [1000, 12, 15], 1),
        (f"{SEMICOLONS}\r\nA;p;0;10;1.5\r\n", [10], 1),
        (HEAD.replace(",", "\t") + "\nA\tp\t0\t10\t1.5\n", [10], 1),
    ],
)
def test_numbers_may_be_written_as_spreadsheets_do(
    tmp_path: Path, text: str, queries: list[int], costs: int
) -> None:
    path = tmp_path / "theirs.csv"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    answers = read_given(str(path)).answers
    assert answers["queries"].tolist() == queries
    assert answers["seed"].tolist() == list(range(len(queries)))
    assert answers["cost"][0] == 1.5 and answers["cost"].notna().sum() == costs


def test_other_bytes_than_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(f"{HEAD}\nA,p,1,10,2.0\n".encode() + b"B\xff,p,1,10,2.0\n")
    with pytest.raises(SettingError, match="line 3: must be text in UTF-8"):
        read_given(str(path))
