"""What a replicate costs besides its planner.

Reading its log, beside mcap's own reader, and its way to the disk.
"""

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap.reader import make_reader

from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.records import generations
from evoexp.store.files import write_file, write_files
from evoexp.store.log_reader import generation_columns, read_log, read_summary

WORDS = ("experiment=rana_planar", "ga.num_generations=100", "ga.population_size=10")
BUNDLE = 20  # logs stored together


@pytest.fixture(scope="module")
def content() -> bytes:
    """Return the log of a replicate of 100 generations."""
    condition = compose.expand(WORDS)[0].conditions[0].condition
    return run_replicate(condition, 0).content


def frame_by_mcap(content: bytes) -> pd.DataFrame:
    found = make_reader(io.BytesIO(content)).iter_messages(topics=["/generation"])
    return pd.DataFrame([json.loads(message.data) for _, _, message in found])


def bench_read_generations(beside: Any, content: bytes) -> None:
    ours, theirs = generation_columns(content), frame_by_mcap(content)
    np.testing.assert_array_equal(ours["evaluations"], theirs["evaluations"])
    np.testing.assert_array_equal(ours["best_cost"], theirs["best_cost"].to_numpy(np.float64))
    assert len(ours["index"]) == 101
    beside(
        "columns of 101 generations from a log, checked",
        lambda: generation_columns(content),
        {"mcap, json and pandas": (lambda: frame_by_mcap(content), 1, 1)},
        "log",
    )


def bench_read_summary(beside: Any, content: bytes) -> None:
    def by_mcap() -> dict[str, Any]:
        records = make_reader(io.BytesIO(content)).iter_metadata()
        (texts,) = (record.metadata for record in records if record.name == "evoexp.summary")
        return {name: json.loads(text) for name, text in texts.items()}

    assert math.isclose(read_summary(content).best_cost, by_mcap()["best_cost"])
    references = {
        "mcap, unchecked": (by_mcap, 1.0, 1),
        "the whole log, its content digest compared": (lambda: read_log(content), 1.0, 1),
    }
    beside("summary of a log, checked", lambda: read_summary(content), references, "log")


def bench_store_logs(beside: Any, content: bytes, tmp_path: Path) -> None:
    paths = [tmp_path / f"{k:04d}.mcap" for k in range(BUNDLE)]

    def one_by_one() -> None:
        for path in paths:
            write_file(path, content)

    beside(
        f"{BUNDLE} logs to the disk, each whole or not there",
        lambda: write_files(dict.fromkeys(paths, content)),
        {"one by one": (one_by_one, BUNDLE, 1)},
        "log",
        amount=BUNDLE,
        rounds=20,
    )


def bench_replicate_overhead(beside: Any) -> None:
    """A replicate of 100 generations with its log.

    Its verdict and its summary beside its planner alone.
    """
    condition = compose.expand(WORDS)[0].conditions[0].condition
    config_json, (planner, problem) = condition.to_json(), condition.prepare()

    def planner_alone() -> None:
        for _ in generations(planner.evolve(problem, condition.rng(0))):
            pass

    references = {"its planner alone": (planner_alone, 1.0, 1)}
    beside(
        "a replicate of 100 generations",
        lambda: run_replicate(condition, 0, config_json),
        references,
        "replicate",
    )
