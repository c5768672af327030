"""References run, are stored, shown, reproduced and reported like conditions of one replicate.

They have the same bits whatever number of threads linear algebra has.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  # loads the BLAS whose threads are counted
from threadpoolctl import threadpool_info, threadpool_limits

from composed import composed
from evoexp.batch import replicate
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import farthest, field_differences, fingerprint
from evoexp.batch.runner import Batch
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.errors import EvoexpError
from evoexp.references.reference import one_thread
from evoexp.report.results.stored_results import gather
from evoexp.store.identity import environment
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from guests import on_path, write_distribution
from masked_logs import masked_log

SMALL = ("ga.population_size=8", "ga.num_generations=2", "planner.num_new_trajectories=1")
EXPERIMENT = ("experiment=rana_obstacles", *SMALL, "runner=serial")
WORDS = (*EXPERIMENT, "+reference._target_=counted")


@pytest.fixture(autouse=True)
def registered(tmp_path: Path) -> Iterator[None]:
    """Have a reference of our own among the registered components."""
    components = {"counted": "references.counted:Counted"}
    write_distribution(tmp_path / "guest", "counted", components=components)
    with on_path(tmp_path / "guest"):
        yield


@pytest.fixture
def said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Return what runs a command and gives its exit code and what it printed."""
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "outputs"))
    monkeypatch.setenv("COLUMNS", "200")

    def run(*words: str, code: int = 0) -> str:
        assert main(words) == code, capsys.readouterr()
        return capsys.readouterr().out

    return run


def test_a_reference_stands_around_the_planner_and_overrides_reach_it() -> None:
    (experiment,) = compose.expand([*WORDS, "num_replicates=9", "ga.mutation_rate=0.5"])
    ((_, found),) = experiment.conditions
    assert found.is_reference
    assert found.planner.component == "counted"
    assert found.planner.planner.ga.mutation_rate == 0.5
    assert (experiment.num_replicates, found.num_replicates(experiment.num_replicates)) == (9, 1)

    without = composed("experiment=rana_obstacles")
    assert not without.is_reference
    assert without.num_replicates(7) == 7
    assert composed("experiment=rana_obstacles", "reference=null").id == without.id


@pytest.mark.parametrize(
    ("field", "words", "message"),
    [
        ("reference", ["control=random_search"], "must be left out beside a control, was"),
        ("reference.planner", ["+reference.planner=1"], "must be left out: it is the chosen"),
        ("reference.rows", ["+reference.rows=x"], "must be a whole number, was 'x'"),
        ("reference", ["+reference.rows=4"], "must be chosen: "),
    ],
)
def test_what_cannot_be(field: str, words: list[str], message: str) -> None:
    with pytest.raises(EvoexpError) as error:
        compose.expand([*(EXPERIMENT if "chosen: " in message else WORDS), *words])
    assert str(error.value).startswith(f"{field}: {message}")


def test_the_log_carries_the_arrays_and_reads_them_one_by_one() -> None:
    found = composed(*WORDS)
    log = read_log(run_replicate(found, 0).content)
    assert len(log.generations) == 1
    assert log.summary.terms["share"] == 0.25
    arrays = log.arrays()
    assert list(arrays) == ["counts", "table"]
    np.testing.assert_array_equal(arrays["table"][:, 0], [0.0, 0.1, 0.2])
    assert np.isinf(arrays["table"][:, 1]).all()
    assert arrays["counts"].dtype == np.int64
    assert run_replicate(found, 0).summary.digest == log.summary.digest
    # arrays that are missing differ
    other = read_log(run_replicate(composed(*WORDS, "+reference.rows=4"), 0).content)
    for changed, name, distance in (
        (log, "", 0.0),
        (log._replace(attachments=other.attachments), "attachment table.npy: values", np.inf),
        (log._replace(attachments={}), "attachment counts.npy", np.inf),
    ):
        assert farthest(field_differences(log, changed)) == (name, distance)
    assert fingerprint(found, log.summary) == f"cost {log.summary.best_cost!r}"


@pytest.mark.matrix
def test_run_list_show_reproduce_report(
    said: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for budget in ("paper", "smoke"):
        printed = said("run", *WORDS, "num_replicates=4", f"budget={budget}")
        assert "1 of 1" in printed
    found = composed(*WORDS)
    assert found.id[:12] in said("list")
    shown = said("show", found.id[:12])
    assert "array table: 3 × 3" in shown
    assert "1 of 1 MATCH" in said("reproduce", found.id[:12])
    monkeypatch.setenv("DISTURBED", "1e-10")
    assert "DIVERGES at generation 0" in said("reproduce", found.id[:12], code=1)
    elsewhere = environment() | {"cpu": {"name": "another", "features": []}}
    monkeypatch.setattr(replicate, "environment", lambda components: elsewhere)
    assert "MATCH to 1e-09 (in another environment; at most" in said("reproduce", found.id[:12])
    monkeypatch.setenv("DISTURBED", "1e-3")
    assert "DIVERGES by" in said("reproduce", found.id[:12], code=1)


@pytest.mark.matrix
def test_the_report_reads_references_beside_the_planners(
    said: Callable[..., str], tmp_path: Path
) -> None:
    said("run", *WORDS[:-1], "num_replicates=2")
    said("run", *WORDS, "num_replicates=2")
    conditions = [("ga", composed(*WORDS[:-1])), ("truth", composed(*WORDS))]
    results = gather(tmp_path / "outputs", conditions, 2, "", "", "")
    ga, truth = results.conditions
    assert (ga.planned, truth.planned, ga.done, truth.done) == (2, 1, 2, 1)
    assert (ga.is_reference, truth.is_reference, truth.is_control) == (False, True, False)
    assert [c.label for c in results.main] == [c.label for c in results.evolved] == ["ga"]
    assert [c.label for c in results.references] == ["truth"]
    assert truth.planner == ga.planner
    assert truth.array("table").shape == (3, 3)
    with pytest.raises(KeyError):
        ga.array("table")
    page = said("report", *(c.id[:12] for _, c in conditions)).split("report: ")[1].strip()
    assert "reference" in Path(page).read_text()
    assert Path(page).with_name("convergence.csv").read_text().count("reference") == 1


def test_references_run_first(tmp_path: Path) -> None:
    planner, truth = (composed(*w) for w in (WORDS[:-1], WORDS))
    batch = Batch([(planner, 2, {}), (truth, 1, {})], RunnerSettings(num_workers=1), tmp_path)
    assert [job.condition_id for job in batch.jobs] == [truth.id, planner.id, planner.id]
    assert len(list(batch.run())) == 3
    assert RunDirectory(tmp_path, truth.id).completed() == {0}


LABEL = "B platform, conventional"  # whose optimiser takes other steps with two threads


def num_threads() -> list[int]:
    return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]


def test_threads_are_one_inside_and_as_before_outside() -> None:
    with threadpool_limits(2, "blas"):
        assert set(num_threads()) == {2}, "numpy and scipy have a BLAS each"
        with one_thread():
            assert set(num_threads()) == {1}
        assert set(num_threads()) == {2}


@pytest.mark.parametrize("threads", [1, 2])
def test_a_reference_beside_any_number_of_threads(threads: int) -> None:
    condition = composed("experiment=chen_placement", "budget=smoke", label=LABEL)
    plain = masked_log(run_replicate(condition, 0).content)
    with threadpool_limits(threads, "blas"):
        assert masked_log(run_replicate(condition, 0).content) == plain
