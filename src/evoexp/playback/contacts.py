"""Distances of the bodies over a motion, and every stretch of it in which bodies touch."""

from itertools import takewhile
from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import PAIR
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Part, Scene
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

UNLIMITED = 10**12  # queries of coal
SLACK = 1e-6  # [-] of the scene's size: what coal's distances may be below their bounds
END_RESOLUTION = 1e-6  # [instants] of the end of a contact


class Contact(NamedTuple):
    """A stretch of a motion in which bodies touch."""

    begin: float  # begin of the contact [instants]
    # End of the contact, to 1e-6 [instants]; bodies that part for less than a tick count as
    # touching all the time
    end: float
    pair: str  # names of the bodies that touch first


class Clearance(NamedTuple):
    """Exact distances of the watched bodies."""

    # (ticks,) least distance of two watched bodies [length unit]; 0 where bodies touch, inf if none
    # is watched
    least: FloatArray
    pairs: tuple[str, ...]  # (ticks,) names of the two nearest bodies; empty if none is watched
    contacts: tuple[Contact, ...]  # all contacts in the order of time


def part_at(parts: list[Part], t: float) -> Part:
    """Return the piece that an instant lies in; at the end of a piece, the next piece."""
    return next((part for part in parts if t < part.last), parts[-1])


def clearance(parts: list[Part], motion: Motion, times: FloatArray) -> Clearance:
    """Return the distances at times (ticks,) [instants], from 0 to the end, and all contacts."""
    least, pairs, contacts = [], [], list[Contact]()
    watches = {id(part): _Watch(part.scene, motion) for part in parts}
    for t in times:
        distance, pair = watches[id(part_at(parts, t))].nearest(t)
        least.append(max(distance, 0.0))
        pairs.append(pair)
    for part in parts:
        inside = times[(times > part.first) & (times < part.last)]
        for contact in _contacts(watches[id(part)], part, motion, np.append(inside, part.last)):
            # join contacts of which one begins where the other ends
            if contacts and contact.begin <= contacts[-1].end + END_RESOLUTION:
                end = max(contact.end, contacts[-1].end)
                contacts[-1] = contacts[-1]._replace(end=end)
            else:
                contacts.append(contact)
    return Clearance(np.array(least), tuple(pairs), tuple(contacts))


class _Watch:
    """The pairs of one scene, watched along a motion by coal."""

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self.scene, self._distance = scene, CoalDistance(scene, motion, UNLIMITED)

    def nearest(self, t: float) -> tuple[float, str]:
        """Return the least distance and the names of its pair; inf and nothing without pairs."""
        best: tuple[float, int] = np.inf, -1
        least = self._least(t)
        for pair in np.argsort(least, kind="stable"):
            if least[pair] > best[0]:
                break
            best = min(best, (self._distance(int(pair), t), int(pair)))
        distance, pair = best
        return distance, PAIR.join(self.scene.pair_names(pair)) if pair >= 0 else ""

    def touching(self, t: float) -> bool:
        """Return whether any pair is in contact."""
        near = np.flatnonzero(self._least(t) <= self.scene.tolerances)
        return any(self._distance(int(pair), t) <= self.scene.tolerances[pair] for pair in near)

    def _least(self, t: float) -> FloatArray:
        """Return bounds of the distances from below, (pairs,); coal is asked where they are low."""
        return self._distance.least(t) - SLACK * self.scene.size


def _contacts(watch: _Watch, part: Part, motion: Motion, ticks: FloatArray) -> list[Contact]:
    """Return the contacts of one piece: the certifier finds their begin, bisection their end."""
    contacts: list[Contact] = []
    t = float(part.first)
    while t < part.last or (t == part.last == part.first and not contacts):
        rest = remainder(motion, t, part.last)
        verdict = certify(watch.scene, rest)
        if verdict.status != "refuted":
            break
        # the instant of the whole motion: the rest's first segment is the rest of a segment
        begin, segment = verdict.refuted_at, int(t)
        begin = t + begin * (segment + 1 - t) if begin < 1.0 else segment + begin
        pair = PAIR.join(verdict.refuted_pair or ())
        later = ticks[ticks > begin].tolist()
        in_contact = [begin, *takewhile(watch.touching, later)]
        touching = in_contact[-1]
        if touching == part.last:
            contacts.append(Contact(begin, touching, pair))
            break
        t = free = later[len(in_contact) - 1]
        while free - touching > END_RESOLUTION:
            middle = 0.5 * (free + touching)
            touching, free = (middle, free) if watch.touching(middle) else (touching, middle)
        contacts.append(Contact(begin, touching, pair))
    return contacts


def remainder(motion: Motion, t: float, last: int) -> Motion:
    """Return the rest of a motion from t, which may lie inside a segment, up to an instant."""
    segment = min(int(t), max(motion.num_segments - 1, 0))
    u = t - segment
    q = motion.q[segment : last + 1]
    if motion.coefficients is None:
        return Motion(np.vstack([motion.at(t)[None], q[1:]]))
    left = motion.coefficients[segment:last].copy()
    c0, c1, c2, c3 = motion.coefficients[segment]
    w = 1.0 - u  # u + w v takes the place of u
    left[0] = (
        c0 + u * (c1 + u * (c2 + u * c3)),
        w * (c1 + u * (2.0 * c2 + 3.0 * u * c3)),
        w * w * (c2 + 3.0 * u * c3),
        w * w * w * c3,
    )
    return Motion(np.vstack([left[:1, 0], q[1:]]), left)
