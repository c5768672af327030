"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, get_args

from evoexp.attachments import SHA256, file_content, keep, located
from evoexp.errors import SettingError
from evoexp.mesh_files import mesh_content, package_folders
from evoexp.robots.assembly import AppendArm, Assembly, assembled
from evoexp.robots.joint_choice import urdf_notes
from evoexp.robots.mesh_checks import whole_mesh
from evoexp.robots.mesh_pieces import Decomposition, mesh_pieces
from evoexp.robots.robot_data import robot_file
from evoexp.robots.urdf_arms import UrdfTree
from evoexp.robots.urdf_model import given_spheres
from evoexp.robots.urdf_reading import parsed_xml, read_urdf, urdf_file
from evoexp.robots.urdf_settings import UrdfSettings


@contextlib.contextmanager
def _named(file: Any) -> Iterator[None]:
    """Add the name of a file to the refusals of what is in it."""
    try:
        yield
    except SettingError as error:
        hint = f"{error.hint}; in {file}"
        raise SettingError(error.field, error.must, error.was, hint) from None


class Urdf(UrdfSettings):
    """An arm out of a URDF; in a configuration `path` (and `srdf`) name the files that are read.

    `packages` tells the folders of packages of meshes, by their names.
    """

    component: ClassVar[str] = "urdf"

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether pairs are still to be derived."""
        return settings.get("pairs") is None and "urdf" in settings

    def build(self) -> Assembly:
        """Return the robot with its derived pairs, given spheres and the frames of its links."""
        tree = UrdfTree(self)
        spheres = None
        if self.spheres:
            rows = given_spheres(self, tree.model, tree.bodies)
            spheres = dict(zip(tree.names, rows, strict=True))
        return assembled(tree.arms())._replace(
            pairs=self.pairs.content if self.pairs else None,
            spheres=spheres,
            frames=tree.link_frames(),
        )

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arms: one, or one per group."""
        return UrdfTree(self).arms()

    def notes(self) -> list[str]:
        """Remark on what the URDF leaves open: bodies, limits, units."""
        return list(urdf_notes(self))

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths."""
        settings = dict(settings)
        if "path" not in settings:
            return settings
        path = robot_file(settings.pop("path"), f"{field}.path")
        if path in (None, "???"):
            raise SettingError(f"{field}.path", "given: the path of a URDF", None)
        srdf = robot_file(settings.pop("srdf", None), f"{field}.srdf")
        packages = package_folders(settings.pop("packages", None), f"{field}.packages")
        content = file_content(path, f"{field}.path")
        file = Path(located(str(path)))
        with _named(file):
            links = urdf_file(content, f"{field}.path").links
        meshes: dict[str, dict[str, Any]] = {}
        how: Any = settings.get("decomposition")
        bodies = ((link, body.mesh) for link, own in links.items() for body in own)
        for link, name in bodies:
            if name is None or name in meshes:
                continue
            with _named(f"link '{link}' of {file}"):
                data = mesh_content(name, file, packages, f"{field}.path")
                data = whole_mesh(data, name, f"{field}.path")
            meshes[name] = {"name": name, "file": {SHA256: keep(data)}}
            if how in get_args(Decomposition):
                cut = mesh_pieces(data, Path(name).suffix, how, f"{field}.decomposition")
                meshes[name]["pieces"] = {SHA256: keep(cut)}
        settings["urdf"] = {SHA256: keep(content)}
        if meshes:
            settings["meshes"] = list(meshes.values())
        for name, path in (("spheres", settings.pop("spheres", None)), ("srdf", srdf)):
            if path is None:
                continue
            content = file_content(path, f"{field}.{name}")
            with _named(path):
                if name == "spheres":
                    read_urdf(content, f"{field}.spheres")
                else:
                    parsed_xml(content, f"{field}.srdf", "robot")
            settings[name] = {SHA256: keep(content)}
        return settings
