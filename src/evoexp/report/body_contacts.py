"""Contacts of bodies that the exact verdict found: their instants, pairs and places."""

import numpy as np

from evoexp.collision.certifier.certificate import PAIR
from evoexp.condition import Prepared
from evoexp.records import FloatArray
from evoexp.report.motion_geometry import BodyDistance
from evoexp.report.results import ConditionResults


def refuted(condition: ConditionResults) -> dict[int, tuple[float, str]]:
    """Return the first contact of every refuted motion: replicate → (instant, its pair)."""
    rows = condition.summaries[condition.summaries["refuted_at"].notna()]
    columns = zip(rows.index, rows["refuted_at"], rows["refuted_pair"], strict=True)
    return {int(k): (float(instant), str(pair)) for k, instant, pair in columns}


def contact(
    prepared: Prepared, solution: FloatArray, instant: float, pair: str
) -> tuple[float, float]:
    """Return the point in the plane, (x, y), at which two bodies touch."""
    planner, problem = prepared
    motion = planner.motion(problem, solution)
    scene = next(p.scene for p in planner.parts(problem, motion) if p.first <= instant <= p.last)
    number = [PAIR.join(scene.pair_names(k)) for k in range(len(scene.pairs))].index(pair)
    points = BodyDistance(scene.model, scene.geometry).nearest(motion.at(instant), number).points
    x, y, _ = np.mean(points, axis=0)
    return float(x), float(y)
