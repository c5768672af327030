"""The bodies that the exact verdict judges.

How far they are apart along a motion, and where they first touch.
"""

import numpy as np
import pinocchio as pin

from evoexp.collision.certifier.certificate import PAIR
from evoexp.collision.scene import Scene
from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.report.results import ConditionResults


def distances(scene: Scene, q: FloatArray) -> FloatArray:
    """Return the least distance of bodies that must not touch at each configuration.

    0 where they do.

    Args:
        scene: The bodies.
        q: (nq, configurations) [deg].
    """
    data, geometry = scene.model.createData(), scene.geometry.createData()
    found = np.empty(q.shape[1])
    for k, configuration in enumerate(np.ascontiguousarray(q.T)):
        pin.updateGeometryPlacements(
            scene.model, data, scene.geometry, geometry, DEGREE * configuration
        )
        pin.computeDistances(scene.geometry, geometry)
        found[k] = min(
            geometry.distanceResults[pair].min_distance for pair in range(len(scene.pairs))
        )
    return np.maximum(found, 0.0)


def refuted(condition: ConditionResults) -> dict[int, tuple[float, str]]:
    """Return when and between which bodies the first contact is.

    By replicate whose motion the verdict refutes.
    """
    rows = condition.summaries[condition.summaries["refuted_at"].notna()]
    found = zip(rows.index, rows["refuted_at"], rows["refuted_pair"], strict=True)
    return {int(replicate): (float(instant), str(pair)) for replicate, instant, pair in found}


def contact(
    prepared: Prepared, solution: FloatArray, instant: float, pair: str
) -> tuple[float, float]:
    """Return where two bodies touch in the plane (x, y).

    Args:
        prepared: Planner and problem.
        solution: Whose motion.
        instant: Of the first contact.
        pair: Names of the bodies, as the verdict gives them.
    """
    scene = prepared.problem.scene
    number = [PAIR.join(scene.pair_names(k)) for k in range(len(scene.pairs))].index(pair)
    data, geometry = scene.model.createData(), scene.geometry.createData()
    q = prepared.planner.motion(prepared.problem, solution).at(instant)
    pin.updateGeometryPlacements(scene.model, data, scene.geometry, geometry, q)
    result = pin.computeDistance(scene.geometry, geometry, number)
    x, y, _ = 0.5 * (result.getNearestPoint1() + result.getNearestPoint2())
    return float(x), float(y)
