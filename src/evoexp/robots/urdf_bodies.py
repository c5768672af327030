"""The collision bodies of a URDF, built by Pinocchio and compared with the file, link by link."""

from pathlib import Path
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError
from evoexp.robots.mesh_checks import load, unused_vertices
from evoexp.robots.urdf_reading import LARGEST
from evoexp.robots.urdf_rewriting import JointRules, plain_urdf

PARTED = (".obj", ".dae")  # endings of meshes with parts, see `mesh_checks`


class BodyText(NamedTuple):
    """A collision body as a URDF gives it."""

    kind: str  # a shape of `urdf_reading.SHAPES`
    sizes: tuple[float, ...]  # edges | radius | radius, length | scale of a mesh
    mesh: str = ""  # its name

    def __str__(self) -> str:
        """Name the body in a message."""
        return " ".join(filter(None, [self.kind, self.mesh, *(f"{size:g}" for size in self.sizes)]))


def body_texts(root: Any) -> dict[str, list[BodyText]]:
    """List the collision bodies of each link of a URDF that `read_urdf` returned."""
    return {
        link.get("name"): [_text(link, collision) for collision in link.iterfind("collision")]
        for link in root.iterfind("link")
    }


def built_bodies(
    model: Any, root: Any, rules: JointRules, places: dict[str, Path], field: str
) -> Any:
    """Build the collision bodies of a URDF.

    Args:
        model: Pinocchio's, of the same URDF.
        root: That `read_urdf` returned.
        places: Where each mesh lies.
        field: That names the URDF, for errors.

    Returns:
        The bodies, a `pin.GeometryModel`.

    Raises:
        SettingError: If a mesh cannot be read, or a body is another than the file's.
    """
    texts = body_texts(root)
    text = plain_urdf(root, rules, {name: str(place) for name, place in places.items()})
    try:
        bodies = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION, None, "")
    except (ValueError, RuntimeError) as error:
        for name, place in places.items():
            load(place.read_bytes(), place.suffix, name, field)
        reason = str(error).strip().splitlines()[0]
        raise SettingError(field, "a URDF whose collision bodies can be read", reason) from None
    by_link: dict[str, list[Any]] = {name: [] for name in texts}
    for item in bodies.geometryObjects:
        by_link.setdefault(item.name.rpartition("_")[0], []).append(item)
    for link, items in by_link.items():
        expected = texts.get(link, [])
        if len(items) != len(expected):
            must = f"a URDF whose bodies are built as they are given (link '{link}': "
            raise SettingError(field, f"{must}{len(expected)})", f"{len(items)} bodies")
        for body, item in zip(expected, items, strict=True):
            if body.kind == "capsule" and isinstance(item.geometry, coal.Cylinder):
                item.geometry = coal.Capsule(item.geometry.radius, 2.0 * item.geometry.halfLength)
            if reason := _difference(body, item):
                must = "a URDF whose bodies are built as they are given"
                raise SettingError(field, must, f"link '{link}', {body}: {reason}")
    return bodies


def _text(link: Any, collision: Any) -> BodyText:
    (shape,), kind = collision.find("geometry"), collision.find("geometry")[0].tag
    for other, plain in (("capsule", "cylinder"), ("convex", "mesh")):
        names = [item.get("name") for item in link.iterfind(f"collision_checking/{other}")]
        if kind == plain and collision.get("name") in names:
            kind = other
    attributes = {"box": ("size",), "sphere": ("radius",), "mesh": ("scale",)}
    words = [shape.get(name, "1 1 1") for name in attributes.get(shape.tag, ("radius", "length"))]
    sizes = tuple(map(float, " ".join(words).split()))
    return BodyText(kind, sizes, shape.get("filename", ""))


def _difference(body: BodyText, item: Any) -> str:
    """Tell how a built body differs from the file's; empty: it does not."""
    shape = item.geometry
    kind = type(shape).__name__.lower()
    if body.mesh:
        is_convex = isinstance(shape, coal.ConvexBase)
        kind = "convex" if is_convex else "mesh" if isinstance(shape, coal.BVHModelBase) else kind
        points = [shape.point(k) for k in range(shape.num_points)] if is_convex else []
        if not np.isfinite(points if is_convex else shape.vertices()).all():
            return "a vertex that is no finite number"
        if (
            not is_convex
            and body.mesh.lower().endswith(PARTED)
            and (count := unused_vertices(shape))
        ):
            return f"{count} of {shape.num_vertices} vertices end in no triangle"
        sizes = tuple(np.ravel(item.meshScale))
    elif isinstance(shape, coal.Box):
        sizes = tuple(2.0 * shape.halfSide)
    else:
        half = (2.0 * shape.halfLength,) if hasattr(shape, "halfLength") else ()
        sizes = (shape.radius, *half)
    if (kind, sizes) != (body.kind, body.sizes):
        return f"built as {BodyText(kind, tuple(map(float, sizes)))}"
    far = np.abs(item.placement.translation).max()
    shape.computeLocalAABB()
    if not 0.0 <= far + shape.aabb_radius <= LARGEST:
        return f"it reaches to {far + shape.aabb_radius:.3g}, beyond {LARGEST:g} m"
    return ""
