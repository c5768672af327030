"""Which pairs of a robot's bodies are worth testing, found once by sampled configurations.

As MoveIt's setup assistant does it: neighbours, pairs that always touch, and pairs that were never
seen to touch. The result is data, attached to a condition, and so it is the same wherever the
condition is run again. A search leaves out all three; the certifier judges the pairs that were
never seen to touch, since samples prove nothing.
"""

import itertools
import json
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.box_support import coal
from evoexp.errors import SettingError
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly

SAMPLES = 2000  # random configurations
FIELD = "robot.pairs"

Pair = tuple[int, int]
NamePair = frozenset[str]


class DerivedPairs(NamedTuple):
    """Pairs of bodies that a search leaves out, by their names."""

    # pairs on one joint or on neighbouring ones, which are never judged
    neighbours: tuple[NamePair, ...]
    disabled: tuple[NamePair, ...]  # pairs that the SRDF switches off, which are never judged
    # pairs that touch in every configuration sampled, which are never judged
    always: tuple[NamePair, ...]
    never: tuple[NamePair, ...]  # pairs that touch in none; the certifier judges them
    samples: int  # how many configurations were sampled

    def to_json(self) -> bytes:
        """Return the pairs as data that is attached to a condition."""
        pairs = {name: [sorted(pair) for pair in getattr(self, name)] for name in self._fields[:4]}
        return json.dumps({**pairs, "samples": self.samples}, indent=1).encode()

    @classmethod
    def from_json(cls, content: bytes) -> "DerivedPairs":
        """Read the pairs from attached data.

        Raises:
            SettingError: If the data is none of that kind.
        """
        try:
            found = json.loads(content)
            neighbours, disabled, always, never = (
                tuple(frozenset((str(one), str(two))) for one, two in found[name])
                for name in cls._fields[:4]
            )
            return cls(neighbours, disabled, always, never, int(found["samples"]))
        except (ValueError, LookupError, TypeError, RecursionError):
            raise SettingError(FIELD, "derived pairs of bodies", content[:40]) from None


def are_neighbours(assembly: Assembly, one: int, two: int) -> bool:
    """Return whether one joint carries two bodies, or neighbouring joints do."""
    items, parents = assembly.geometry.geometryObjects, assembly.model.parents
    i, j = items[one].parentJoint, items[two].parentJoint
    return bool(i == j or (i > 0 and parents[i] == j) or (j > 0 and parents[j] == i))


def unjudged_pairs(assembly: Assembly) -> set[NamePair]:
    """Return pairs of names that nobody judges, besides neighbours: disabled, always touching."""
    derived = None if assembly.pairs is None else DerivedPairs.from_json(assembly.pairs)
    return {*assembly.disabled, *(() if derived is None else derived.always)}


def derive_pairs(assembly: Assembly, samples: int = SAMPLES) -> DerivedPairs:
    """Sort the pairs of a robot's bodies; the same robot gives the same pairs."""
    groups: dict[str, list[NamePair]] = {name: [] for name in DerivedPairs._fields[:4]}
    apart = dict[Pair, NamePair]()
    items = enumerate(assembly.geometry.geometryObjects)
    for (a, one), (b, two) in itertools.combinations(items, 2):
        names = frozenset((one.name, two.name))
        if are_neighbours(assembly, a, b):
            groups["neighbours"].append(names)
        elif names in assembly.disabled:
            groups["disabled"].append(names)
        else:
            apart[a, b] = names
    touched, parted = contacts_seen(assembly, list(apart), samples)
    for group, is_seen in (("always", parted), ("never", touched)):
        groups[group] = list(itertools.compress(apart.values(), ~is_seen))
    neighbours, disabled, always, never = map(tuple, groups.values())
    return DerivedPairs(neighbours, disabled, always, never, samples)


def sampled_configurations(assembly: Assembly, count: int) -> FloatArray | None:
    """Return random configurations (nq, count); None if a joint has no limits."""
    limits = joint_limits(assembly)
    if not np.isfinite(limits).all():
        return None
    low, high = limits
    rng = np.random.Generator(np.random.PCG64(0))  # no search draws from it
    return np.asarray(low[:, None] + (high - low)[:, None] * rng.random((len(low), count)))


def joint_limits(assembly: Assembly) -> FloatArray:
    """Return least and greatest q, (2, nq); infinite where a joint has no limit."""
    model = assembly.model
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit])
    return np.where(np.abs(limits) < 1e6, limits, np.inf)


def contacts_seen(
    assembly: Assembly, pairs: list[Pair], samples: int
) -> tuple[BoolArray, BoolArray]:
    """Return which pairs touch on coal's geometry, and which are apart, in any of some samples."""
    # without limits of all joints, all pairs count as seen both ways
    touched = np.zeros(len(pairs), dtype=np.bool_)
    parted = np.zeros(len(pairs), dtype=np.bool_)
    q = sampled_configurations(assembly, samples)
    if q is None:
        return ~touched, ~parted
    model, geometry = assembly.model, assembly.geometry
    data, placements = model.createData(), geometry.createData()
    shapes = [item.geometry for item in geometry.geometryObjects]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    for n in range(samples):
        left = np.flatnonzero(~(touched & parted))  # a pair seen both ways is done
        if len(left) == 0:
            break
        posture = np.ascontiguousarray(q[:, n])
        pin.updateGeometryPlacements(model, data, geometry, placements, posture)
        places: dict[int, Any] = {}
        for k in left.tolist():
            result.clear()
            one, two = pairs[k]
            for body in (one, two):
                if body not in places:
                    where = placements.oMg[body]
                    places[body] = coal.Transform3s(where.rotation, where.translation)
            hit = coal.collide(shapes[one], places[one], shapes[two], places[two], request, result)
            (touched if hit > 0 else parted)[k] = True
    return touched, parted
