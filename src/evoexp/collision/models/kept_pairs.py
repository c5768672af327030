"""Sorted pairs of a robot's bodies, kept on disk: to prove that some never touch takes longest."""

from evoexp.collision.models.body_pairs import BodyPairs, body_pairs
from evoexp.collision.models.primitive_tables import Shapes
from evoexp.robots.assembly import Assembly
from evoexp.store.kept_facts import kept_answer


def kept_body_pairs(assembly: Assembly, shapes: Shapes, made_from: bytes) -> BodyPairs:
    """Return the pairs of `body_pairs`, from where they are kept if they were sorted before.

    Args:
        assembly: As of `body_pairs`.
        shapes: As of `body_pairs`.
        made_from: All that both are made from, the code aside; they are kept under it.
    """
    found = kept_answer("body pairs", made_from, lambda: body_pairs(assembly, shapes)._asdict())
    return BodyPairs(**{kind: tuple(map(tuple, pairs)) for kind, pairs in found.items()})
