"""A result does not depend on what the same process ran before, nor on what it runs next."""

import hashlib
import multiprocessing
import random
from concurrent.futures import ProcessPoolExecutor

import pytest

from evoexp.attachments import keep_all
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from masked_logs import masked_log
from matrix import counts
from shipped_conditions import KINDS, of_kind

Results = list[tuple[str, str]]  # condition, hash of its log without its times


def result(line: bytes) -> tuple[str, str]:
    """Run replicate 0 of a condition in this process."""
    condition = Condition.from_json(line)
    content = run_replicate(condition, 0).content
    return condition.id, hashlib.sha256(masked_log(content)).hexdigest()


def results(lines: list[bytes], files: list[bytes], num_orders: int) -> list[Results]:
    """Run each condition in a fork of this process, then all of them here, in several orders."""
    keep_all(files)
    with multiprocessing.get_context("fork").Pool(1, maxtasksperchild=1) as pool:
        alone = pool.map(result, lines, chunksize=1)
    orders = [random.Random(seed).sample(lines, len(lines)) for seed in range(1, num_orders + 1)]
    return [alone, *(list(map(result, order)) for order in orders)]


def check(conditions: list[Condition], num_orders: int) -> None:
    """Compare every order with each condition alone in its process."""
    lines = [condition.to_json() for condition in conditions]
    files = [content for each in conditions for content in each.files().values()]
    context = multiprocessing.get_context("spawn")  # in which nothing has run
    with ProcessPoolExecutor(1, context) as pool:
        alone, *orders = pool.submit(results, lines, files, num_orders).result()
    assert len(dict(alone)) == len({digest for _, digest in alone}) == len(conditions)
    assert len(orders) == num_orders
    for order in orders:
        assert order != alone
        assert dict(order) == dict(alone)


def test_a_sample() -> None:
    """Circles, boxes of a machine's body, grids with a second stage, a reference."""
    names = {"rana_obstacles": 0, "corsepius_ball": 0, "chen_mission": 0, "chen_placement": 3}
    check([of_kind(example, "smoke") for example in names.items()], 1)


@pytest.mark.matrix
def test_all_kinds() -> None:
    check([of_kind(kind, "smoke") for kind in KINDS], counts(1, 3))
