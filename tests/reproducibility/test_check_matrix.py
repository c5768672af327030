"""The script that compares interpreters, libraries, processors and surroundings."""

import itertools
from typing import Any

import pytest

import composed
from evoexp.batch.reproduction import TOLERANCE

PROVEN = (  # searches that ask the certifier, and answer by what it says
    *(
        ("certified_search", f"{x}: proofs")
        for x in ("curkovic_a", "lavoie_7dof", "corsepius_shelf")
    ),
    *(("rana_puma", "via-point GA"), ("rrt_connect", "rana_planar")),
)


@pytest.fixture(scope="module")
def script() -> Any:
    return composed.script("check-matrix")


def some_factors(script: Any) -> dict[str, list[Any]]:
    sizes = {"libraries": 4, "workers": 3, "processor": 3, "locale": 2, "threads": 3}
    return {name: [script.Level(f"{name} {k}") for k in range(n)] for name, n in sizes.items()}


def test_each_factor_is_varied_alone(script: Any) -> None:
    base, *others = script.alone(some_factors(script))
    assert len(others) == 3 + 2 + 2 + 1 + 2
    assert all(sum(cell[name] != base[name] for name in base) == 1 for cell in others)


@pytest.mark.parametrize("quick", [False, True])
def test_a_pairwise_cover_has_every_pair(script: Any, quick: bool) -> None:
    factors = some_factors(script)
    cells = list(script.pairwise(factors, quick))
    assert len(cells) < 30
    for one, two in itertools.combinations(factors, 2):
        for first, second in itertools.product(factors[one], factors[two]):
            compiled = {one, two} == {"libraries", "processor"}
            both = factors[one][0] != first and factors[two][0] != second
            met = any(cell[one] == first and cell[two] == second for cell in cells)
            assert met == (not (quick and compiled and both)), (first, second)


def row(**changes: Any) -> dict[str, Any]:
    plain = {"digest": "d", "best_cost": (1.5).hex(), "clearance": (0.25).hex(), "evaluations": 7}
    return plain | {"term_length": (2.0).hex(), "term_newton_evaluations": (9.0).hex()} | changes


def test_differences_are_named(script: Any) -> None:
    off = row(best_cost=(1.5 + 1e-12).hex(), evaluations=8, digest="e")
    far = row(term_length=(2.0 + 10 * TOLERANCE).hex(), term_newton_evaluations=(8.0).hex())
    names, both = "digest, best_cost, evaluations", {"a #0": off, "b #0": off}
    base = {"rows": {"a #0": row(), "b #0": row()}, "composed": ["c"]}
    base |= {"processor": "native", "libraries": "one"}
    for changes, differences in (
        ({}, []),
        ({"composed": ["d"]}, ["composed conditions"]),
        ({"failed": "no numba"}, ["failed: no numba"]),
        ({"rows": {"a #0": row()}}, ["replicates"]),
        ({"rows": both}, [f"a #0: {names}", f"b #0: {names}"]),
        ({"rows": both, "libraries": "two"}, [f"a #0: {names}"]),  # a reference by its numbers
        ({"rows": base["rows"] | {"b #0": far}, "libraries": "two"}, ["b #0: term_length by "]),
    ):
        found = script.compare(base, base | changes, {"a #0": "bits", "b #0": "environment"})
        assert len(found) == len(differences)
        assert all(map(str.startswith, found, differences)), changes


@pytest.mark.matrix
def test_every_factor_that_needs_no_other_interpreter(script: Any, capsys: Any) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "QUICK", (*script.QUICK, *PROVEN))
        assert script.main(["--alone", "--quick"]) == 0, capsys.readouterr().out


def test_an_interpreter_without_the_dependencies_is_left_out(script: Any, capsys: Any) -> None:
    assert len(list(script.interpreters(["/bin/false"]))) == 1
    assert capsys.readouterr().out.startswith("left out: /bin/false: ")
