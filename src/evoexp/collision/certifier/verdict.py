"""The exact certifier: judges a motion continuously, on exact bodies.

A compiled sweep (`certifier.sweep`) bounds the distances of all pairs over the whole motion. It
names the instants of the first contact or of the least clearances, and the intervals for which its
own shapes do not suffice; coal settles both, and every distance in a verdict is coal's, at
Pinocchio's placements.
"""

from typing import Literal, NamedTuple

import numpy as np

from evoexp.collision.certifier import coal_distances
from evoexp.collision.certifier.sweep import Goal, Sweep, sweep_motion
from evoexp.collision.certifier.task import MAX_POLISHED, motion_task, polish, work_space
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.collision.scene import Scene
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

Status = Literal["certified", "refuted", "undecided"]

ROUNDING = 1e-12  # [-] of the scene's size: error of the sweep's own distances
RESOLUTION = 1e-3  # [-] the clearance is proven up to this part of it
MOST_QUERIES, MOST_INTERVALS = 100_000, 2_000_000  # of coal, and of the sweep: then it gives up
SAME = 1e-4  # [segments] a local minimum so close is the same one


class Verdict(NamedTuple):
    """The certifier's verdict on a motion.

    An instant t may lie between two: 2.5 is half way from instant 2 to instant 3.
    """

    # "certified": no two bodies ever touch; "refuted": two do; "undecided": a limit was used up
    status: Status
    margin_status: Status  # the same for "the clearance is never less than the security margin"
    # least distance over the motion [length unit]; 0 where bodies touch, inf without pairs
    clearance: float
    clearance_at: float  # t of it; NaN without pairs
    clearance_pair: tuple[str, str] | None  # names of its two bodies; None without pairs
    refuted_at: float  # t of the first contact; NaN if there is none
    refuted_pair: tuple[str, str] | None  # names of its two bodies
    proven: float  # lower bound of the clearance over the whole motion
    queries: int  # distances that coal was asked for
    intervals: int  # intervals that the sweep judged


def certify(scene: Scene, motion: Motion, security_margin: float | FloatArray = 0.0) -> Verdict:
    """Judge a motion.

    Args:
        scene: The bodies; read only.
        motion: In the units of the model: radians, lengths.
        security_margin: Clearance that the task requires [length unit], one for all pairs of bodies
            or (pairs,) one for each.

    Raises:
        ValueError: If the motion does not fit the model, or a number is out of its range.
    """
    return _Judgement(scene, motion, security_margin, RESOLUTION).verdict()


def is_clear(scene: Scene, motion: Motion, security_margin: float | FloatArray = 0.0) -> bool:
    """Return whether it is proven that no bodies ever touch, or come closer than a margin.

    It answers as `certify` does, but measures no clearance: it ends at the first contact that it
    meets, and does not refine pairs that cannot come near. Undecided counts as no.

    Raises:
        ValueError: As `certify`.
    """
    return _Judgement(scene, motion, security_margin, np.inf).is_clear()


class _Candidate(NamedTuple):
    distance: float
    t: float
    pair: int


class _Judgement:
    def __init__(
        self, scene: Scene, motion: Motion, security_margin: float | FloatArray, resolution: float
    ) -> None:
        _check(scene, motion, security_margin)
        self.margins = np.empty(len(scene.pairs))
        self.margins[:] = security_margin
        self.scene, self.motion = scene, motion
        self.tolerances, self.resolution = scene.tolerances, resolution
        self.coal = coal_distances.CoalDistance(scene, motion, MOST_QUERIES)
        self.floor = 1e-6 * scene.size
        self.intervals, self.looked, self.wants_first = 0, False, True
        self.best = _Candidate(np.inf, np.nan, -1)
        self.task = motion_task(scene, motion)
        self.all_exact, self.work = bool(self.task.exact.all()), work_space(self.task)

    def verdict(self) -> Verdict:
        """Return the verdict."""
        if len(self.scene.pairs) == 0:
            none = np.inf, np.nan, None, np.nan, None
            return Verdict("certified", "certified", *none, np.inf, 0, 0)
        try:
            contact, bound = self._search(self.resolution, self.tolerances, self.tolerances)
            if contact is not None:
                names, at = self.scene.pair_names(contact.pair), float(contact.t)
                where = 0.0, at, names, at, names
                return Verdict("refuted", "refuted", *where, 0.0, self.coal.queries, self.intervals)
            self._polish()
            proven = min(bound, self.best.distance)
            status: Status = "certified" if proven > -np.inf else "undecided"
            return self._free(status, self._judge_margin(status, proven), proven)
        except coal_distances.QueryLimit:
            return self._free("undecided", "refuted" if self._too_close() else "undecided", -np.inf)

    def is_clear(self) -> bool:
        """Return whether all pairs are proven to keep their margins, and not to touch."""
        if len(self.scene.pairs) == 0:
            return True
        self.wants_first = False  # any contact is an answer
        goal = np.maximum(self.margins, self.tolerances)
        level = np.maximum(self.margins - self.tolerances, self.tolerances)
        for each in self.scene.maps:  # a pair that its map proves apart is not looked at
            (own,) = np.nonzero((self.scene.pairs == each.pair).all(axis=1))
            if (each.least(self.motion) > goal[own]).all():
                goal[own] = level[own] = -np.inf
        try:
            contact, bound = self._search(np.inf, goal, level)
        except coal_distances.QueryLimit:
            return False
        return contact is None and bound > -np.inf

    def _free(self, status: Status, margin_status: Status, proven: float) -> Verdict:
        pair = self.scene.pair_names(self.best.pair) if self.best.pair >= 0 else None
        where = float(self.best.distance), float(self.best.t), pair, np.nan, None
        return Verdict(
            status, margin_status, *where, float(proven), self.coal.queries, self.intervals
        )

    def _too_close(self) -> bool:
        pair = self.best.pair
        return pair >= 0 and bool(self.best.distance < self.margins[pair] - self.tolerances[pair])

    def _judge_margin(self, status: Status, proven: float) -> Status:
        """Compare with the margins; search again where the clearance is not proven far enough."""
        if self._too_close():
            return "refuted"
        if status == "undecided" or proven >= self.margins.max():
            return status
        low, bound = self._search(np.inf, self.margins, self.margins - self.tolerances)
        if low is not None:
            if self.task.exact[low.pair]:
                least = np.full(len(self.scene.pairs), np.inf)
                least[low.pair] = low.distance
                self._polish_from(least, np.full(len(least), low.t), low.distance)
            self._note(low)
            return "refuted"
        return "certified" if bound > -np.inf else "undecided"

    def _search(
        self, resolution: float, goal: FloatArray, level: FloatArray
    ) -> tuple[_Candidate | None, float]:
        """Return the first distance at or below its level, measured by coal, and a lower bound.

        The bound is −inf if a limit was used up.
        """
        refine, measured = resolution < np.inf, self.resolution < np.inf
        asked = goal, level, self.tolerances
        precision = resolution, self.floor, ROUNDING * self.scene.size
        if measured and not self.all_exact and self.best.pair < 0:
            # coal's distances of meshes where their convex hulls are closest
            question = Goal(*asked, np.inf, *precision, True, refine, 0)
            found, _ = sweep_motion(self.task, question, self.work)
            pairs = np.flatnonzero(~self.task.exact)
            for pair in pairs[np.argsort(found.pair_least[pairs], kind="stable")][:MAX_POLISHED]:
                t = found.pair_least_at[pair]
                self._note(_Candidate(self.coal(pair, t), t, int(pair)))
        while True:
            known, left = self.best.distance, MOST_INTERVALS - self.intervals
            instants = measured and not (self.looked and refine)
            question = Goal(*asked, known, *precision, instants, refine, left)
            found, done = sweep_motion(self.task, question, self.work)
            self.looked = True
            self.intervals += int(found.nodes[0])
            contact = None
            if found.first[0] < np.inf:
                pair = int(found.first_pair[0])
                near = min(float(found.first[0]), self.task.last)
                t = coal_distances.first_contact(
                    self.coal, pair, near, level[pair], self.wants_first
                )
                if t is None:  # coal sees no contact there: coal alone judges this pair
                    self.task.exact[pair] = self.all_exact = self.looked = False
                    continue
                contact = _Candidate(level[pair], t, pair)
            self.sweep = found
            earlier, proven = self._search_leaves(found, contact, resolution, goal, level)
            return earlier, proven if done else -np.inf

    def _search_leaves(
        self,
        found: Sweep,
        contact: _Candidate | None,
        resolution: float,
        goal: FloatArray,
        level: FloatArray,
    ) -> tuple[_Candidate | None, float]:
        """Have coal settle the leaves, from left to right up to the first contact."""
        proven, leaves = float(found.proven[0]), found.leaves[: found.num_leaves[0]]
        for pair, begin, end in _joined(leaves) if len(leaves) else ():
            if contact is not None and (begin >= contact.t or not self.wants_first):
                break  # later leaves do not matter, or any contact is an answer
            task, p = self.task, int(pair)
            segment = min(int(begin), len(task.coefficients) - 1)
            speeds, scratch = np.empty((2, len(task.pairs))), np.empty(len(task.chain.parent))
            piece, u, v = task.coefficients[segment], begin - segment, end - segment
            approach_bounds(task.chain, piece, u, v, task.weights, speeds, scratch)
            known = min(self.best.distance, float(found.least[0]))
            asked = goal[p], level[p], self.tolerances[p], known, resolution, self.floor
            goals = coal_distances.LeafGoals(*asked, self.wants_first)
            end = min(end, float(self.motion.num_segments))
            leaf = coal_distances.search_interval(self.coal, p, (begin, end), speeds[0, p], goals)
            self._note(_Candidate(leaf.least, leaf.at, p))
            proven = min(proven, leaf.proven)
            if leaf.first < np.inf and (contact is None or leaf.first < contact.t):
                contact = _Candidate(level[p], leaf.first, p)
        return contact, proven

    def _polish(self) -> None:
        found, least = self.sweep, float(self.sweep.least[0])
        worth = least + max(self.resolution * least, self.floor)
        self._polish_from(found.pair_least, found.pair_least_at, worth)
        if self.best.pair >= 0 and not self.task.exact[self.best.pair]:
            distance, t = self.best.distance, self.best.t
            t, distance = coal_distances.walk_down(self.coal, self.best.pair, t, 1e-3)
            self._note(_Candidate(distance, t, self.best.pair))

    def _polish_from(self, least: FloatArray, begins: FloatArray, worth: float) -> None:
        """Ask coal for the least local minimum of the pairs that come as close as `worth`.

        Of equal ones it takes the first in time, and leaves out that which is known. Walks begin at
        an instant of each pair, at which it is `least` apart, (pairs,) each.
        """
        close = np.flatnonzero((least <= worth) & self.task.exact)
        pairs = close[np.argsort(least[close], kind="stable")][:MAX_POLISHED]
        # a motion of one instant is swept as a segment without movement
        t = np.minimum(begins[pairs], self.task.last)
        is_new = (pairs != self.best.pair) | ~(np.abs(t - self.best.t) < SAME)
        pairs, t = pairs[is_new], t[is_new]
        if len(pairs) == 0:
            return
        distances = np.empty(len(pairs))
        polish(self.task, self.work, pairs, t, distances)
        tied = distances <= distances.min() + ROUNDING * self.scene.size
        first = tied & (t <= t[tied].min() + SAME)
        nearest = int(np.argmin(np.where(first, distances, np.inf)))
        pair, at = int(pairs[nearest]), float(t[nearest])
        self._note(_Candidate(self.coal(pair, at), at, pair))

    def _note(self, seen: _Candidate) -> None:
        if seen.distance < self.best.distance:
            self.best = seen


def _joined(leaves: FloatArray) -> FloatArray:
    """Return leaves (leaves, 3) by their begins, neighbours of one pair and segment as one.

    Coal decides by itself where to look in an interval: the longer, the fewer distances it takes.
    """
    pairs, begins, ends = leaves = leaves[np.lexsort((leaves[:, 1], leaves[:, 0]))].T
    is_first = np.ones(len(pairs), dtype=np.bool_)
    is_first[1:] = (pairs[1:] != pairs[:-1]) | (begins[1:] != ends[:-1])
    is_first[1:] |= np.floor(begins[1:]) == begins[1:]  # another segment
    is_last = np.append(is_first[1:], True)
    joined = np.column_stack([pairs[is_first], begins[is_first], ends[is_last]])
    return np.asarray(joined[np.argsort(joined[:, 1], kind="stable")])


def _check(scene: Scene, motion: Motion, security_margin: float | FloatArray) -> None:
    nq = scene.model.nq
    if motion.q.ndim != 2 or motion.q.shape[0] == 0 or motion.q.shape[1] != nq:
        raise ValueError(f"motion: q must have shape (instants, {nq}), was {motion.q.shape}")
    must = (motion.num_segments, 4, nq)
    if motion.coefficients is not None and motion.coefficients.shape != must:
        raise ValueError(
            f"motion: coefficients must have shape {must}, was {motion.coefficients.shape}"
        )
    if not np.isfinite(motion.q).all() or not np.isfinite(motion.polynomials).all():
        raise ValueError("motion: q must be finite, was not")
    margins = np.asarray(security_margin, dtype=np.float64)
    if margins.shape not in ((), (len(scene.pairs),)):
        text = f"one number, or one per pair ({len(scene.pairs)})"
        raise ValueError(f"security_margin must be {text}, was of shape {margins.shape}")
    if not ((margins >= 0.0) & (margins < np.inf)).all():
        raise ValueError(f"security_margin must be at least 0, was {security_margin}")
