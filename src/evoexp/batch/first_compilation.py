"""Compiles the kernels that conditions need before their replicates run, on two cores at once.

The calling process compiles what planners search with. A worker, which would wait meanwhile,
compiles what judges their motions: about half of all.
"""

import contextlib
import itertools
import json
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from evoexp.batch.jobs import load
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.records import FloatArray, generations
from evoexp.registry import component_modules

MOST_GENERATIONS = 1000  # of a search whose kernels are compiled

_NUMBER = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")


class _Kind(NamedTuple):
    """Conditions that need the same kernels.

    Attributes:
        name: Canonical form of a condition without its numbers: another number needs no other
            kernel.
        modules: Of its components.
        config_json: Canonical form of the first of the conditions.
    """

    name: str
    modules: frozenset[str]
    config_json: bytes


class _Searched(NamedTuple):
    """Planner, problem, and the solutions of two generations of a search."""

    planner: Any
    problem: Any
    solutions: tuple[FloatArray, ...]


def compile_all(config_jsons: Iterable[bytes]) -> None:
    """Compile every kernel that some conditions need, once and here, unless they are kept."""
    kinds = _not_compiled(config_jsons)
    # all searches first: a worker compiles the kernels of verdicts meanwhile
    for found in [_search(kind) for kind in kinds]:
        # a planner that fails does so again in its replicate, and is noted there
        with contextlib.suppress(Exception):
            if found is not None:
                for solution in found.solutions:
                    _judge(found.planner, found.problem, solution)


def load_and_compile(config_jsons: Sequence[bytes], files: Sequence[bytes] = ()) -> None:
    """Load what conditions need, as a worker does, and compile what judges their motions."""
    load(config_jsons, files)
    for kind in _not_compiled(config_jsons):
        with contextlib.suppress(Exception):
            planner, problem, rng = _prepared(kind)
            drawn = planner.sample(problem, rng, 1)
            _judge(planner, problem, planner.solution(problem, drawn, 0))


def _not_compiled(config_jsons: Iterable[bytes]) -> list[_Kind]:
    """Return the kinds of conditions whose kernels are not kept."""
    found: dict[str, _Kind] = {}
    for text in config_jsons:
        name = _NUMBER.sub("0", text.decode())
        if name not in found:
            modules = frozenset(component_modules(json.loads(text)))
            found[name] = _Kind(name, modules, text)
    return list(found.values())


def _prepared(kind: _Kind) -> tuple[Any, Any, Any]:
    """Return planner, problem and random numbers of a kind.

    A reference takes long, and mostly needs the kernels of the planner beside it: it is that one.
    """
    condition = Condition.from_json(kind.config_json)
    planner, problem = condition.prepare()
    searching = planner.planner if condition.is_reference else planner
    return searching, problem, condition.rng(0)


def _search(kind: _Kind) -> _Searched | None:
    """Search for two generations, in the last of several stages; None if the planner fails.

    A solution of an earlier stage lacks what the later ones find, and cannot be evaluated.
    """
    with contextlib.suppress(Exception):
        planner, problem, rng = _prepared(kind)
        found = list[FloatArray]()
        for generation in itertools.islice(
            generations(planner.evolve(problem, rng)), MOST_GENERATIONS
        ):
            with contextlib.suppress(SettingError):
                planner.evaluate(problem, generation.best)
                found.append(generation.best.copy())
            if len(found) == 2:
                break
        return _Searched(planner, problem, tuple(found)) if found else None
    return None


def _judge(planner: Any, problem: Any, solution: FloatArray) -> None:
    """Judge the motion of a solution."""
    from evoexp.paths.motion import Motion  # and numba
    from evoexp.planners.proofs import judge_motion

    motion = planner.motion(problem, solution)
    judge_motion(planner, problem, motion)
    # a motion that touches nothing needs the kernels of the closest approach
    if motion is not None:
        judge_motion(planner, problem, Motion(motion.q[[0, 0]]))
