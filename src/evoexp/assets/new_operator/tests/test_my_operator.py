"""The operator keeps every obligation of an operator."""

from typing import Any

import numpy as np
import pytest

from evoexp.evolution.operators.operator import Genome
from evoexp.registry import component_class
from evoexp.testing import check_operator, crossed

MyOperator: Any = component_class("my_operator")  # as a configuration names it


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_it_keeps_its_obligations(share: float) -> None:
    check_operator(MyOperator(share=share))


def test_it_exchanges_as_many_genes_as_it_says() -> None:
    genomes, rng = np.arange(40_000.0).reshape(20, 2000), np.random.default_rng(0)
    genome = Genome.of(np.tile([0.0, 40_000.0], (20, 1)))
    children = crossed(MyOperator(share=0.2), rng, genomes, np.arange(2000), 1.0, genome)
    assert (children != genomes).mean() == pytest.approx(0.2, abs=0.01)
