"""The same digests whatever the number of workers, the order, the hash seed, the threads.

And the processor.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import platformdirs
import pytest

from evoexp.configuration import compose
from matrix import first

HERE = Path(__file__).parent
SMOKE = (
    "experiment=rana_planar,rana_obstacles",
    "budget=smoke",
)  # GA, random search, GA among obstacles
PROVEN = (  # searches that ask the certifier, and answer by what it says
    ("certified_search", "curkovic_a: proofs"),
    ("certified_search", "lavoie_7dof: proofs"),
    ("certified_search", "corsepius_shelf: proofs"),
    ("rana_puma", "via-point GA"),
    ("rrt_connect", "rana_planar"),
)
THREADS = [
    f"{name}_NUM_THREADS"
    for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB", "NUMEXPR", "NUMBA")
]
NUMPY_PATHS = ("X86_V4", "AVX512_ICL")  # numpy's code for AVX-512
GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
VARIED = {"PYTHONHASHSEED", "NPY_DISABLE_CPU_FEATURES", *GENERIC, *THREADS}

Run = Callable[..., Any]


def execute(script: str, *arguments: str, **environment: str) -> Any:
    """Run a script of this directory in a process of its own; return what it prints."""
    inherited = {name: value for name, value in os.environ.items() if name not in VARIED}
    command = [sys.executable, str(HERE / script), *arguments]
    done = subprocess.run(
        command, env=inherited | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def conditions() -> list[str]:
    experiments = compose.expand(SMOKE, multirun=True)
    return [
        labelled.condition.to_json().decode()
        for experiment in experiments
        for labelled in experiment.conditions
    ]


@pytest.fixture(scope="module")
def proven() -> list[str]:
    """Conditions of certified search, none of them in `conditions`."""
    found = []
    for experiment, label in PROVEN:
        words = f"experiment={experiment}", "budget=smoke", "planner.acceptance=certified"
        (chosen,) = (each for each in compose.expand(words)[0].conditions if each.label == label)
        found.append(chosen.condition.to_json().decode())
    return found


@pytest.fixture(scope="module")
def run(conditions: list[str], proven: list[str], tmp_path_factory: pytest.TempPathFactory) -> Run:
    file = tmp_path_factory.mktemp("digests") / "conditions"
    file.write_text("\n".join([*conditions, *proven]))
    return lambda *arguments, **environment: execute(
        "smoke_digests.py", str(file), *arguments, **environment
    )


@pytest.fixture(scope="module")
def plain(run: Run) -> Any:
    """One process, first things first, nothing set."""
    return run()


def generic_cache() -> str:
    """Return a cache directory of the generic target's own, kept.

    So that it is compiled once per state of the sources.

    Not the native one: numba's index of a function can mix up what two processes write to it at the
    same moment.
    """
    return str(
        Path(os.environ.get("EVOEXP_CACHE") or platformdirs.user_cache_dir("evoexp")) / "generic"
    )


@pytest.mark.matrix
def test_the_digests_tell_replicates_and_conditions_apart(plain: Any) -> None:
    count = 3 * (4 + len(PROVEN))
    assert len(plain["digests"]) == len(set(plain["digests"].values())) == count


@pytest.mark.matrix
def test_number_of_workers(run: Run, plain: Any) -> None:
    assert run("--workers=2")["digests"] == plain["digests"]


@pytest.mark.matrix
def test_order_of_conditions_and_replicates(run: Run, plain: Any) -> None:
    turned = run("--workers=1", "--reverse")["digests"]
    assert list(turned) == list(plain["digests"])[::-1]
    assert turned == plain["digests"]


@pytest.mark.matrix
@pytest.mark.parametrize(("seed", "num_threads"), first(1, [("4242", "3"), ("0", "1")]))
def test_hash_seed_and_number_of_threads(
    run: Run, plain: Any, conditions: list[str], seed: str, num_threads: str
) -> None:
    environment = {"PYTHONHASHSEED": seed} | dict.fromkeys(THREADS, num_threads)
    other = run("--compose", *SMOKE, **environment)
    assert other["hash"] != plain["hash"]
    assert other["numba_threads"] == int(num_threads)
    assert other["digests"] == plain["digests"]
    assert other["composed"] == conditions


@pytest.mark.matrix
def test_kernels_compiled_for_a_generic_processor(run: Run, plain: Any) -> None:
    other = run(EVOEXP_CACHE=generic_cache(), **GENERIC)
    assert other["cpu"] == ["generic", ""] != plain["cpu"]
    assert other["digests"] == plain["digests"]


@pytest.mark.matrix
def test_numpy_without_its_widest_code_paths(run: Run, plain: Any) -> None:
    present = [name for name in NUMPY_PATHS if name in plain["numpy_features"]]
    if not present:
        pytest.skip("numpy has no AVX-512 code to switch off on this processor")
    other = run(NPY_DISABLE_CPU_FEATURES=" ".join(present))
    assert not set(present) & set(other["numpy_features"])
    assert other["digests"] == plain["digests"]


@pytest.mark.matrix
@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="ymm and zmm are registers of x86"
)
def test_only_the_processor_itself_has_registers_wider_than_two_numbers(tmp_path: Path) -> None:
    generic = execute("kernel_registers.py", EVOEXP_CACHE=str(tmp_path / "generic"), **GENERIC)
    assert generic["xmm"] > 0, "this is the assembly of real kernels"
    assert (generic["ymm"], generic["zmm"]) == (0, 0)
    native = execute("kernel_registers.py", EVOEXP_CACHE=str(tmp_path / "native"))
    assert native["ymm"] + native["zmm"] > 0
