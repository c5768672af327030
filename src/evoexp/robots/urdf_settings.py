"""The settings of a robot out of a URDF, and the files that they hold."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from evoexp.attachments import File
from evoexp.robots.assembly import Chain
from evoexp.robots.bodies import Point3
from evoexp.robots.mesh_pieces import Decomposition
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_reading import UrdfFile, urdf_file
from evoexp.validation import Positive, Settings

PATH = "robot.path"  # the setting that names the URDF, for errors


class Mesh(Settings):
    """A mesh of a collision body."""

    name: str  # as the URDF names it
    file: File  # its content
    # the convex pieces in its place, see `mesh_pieces`; None: it stays as it is
    pieces: File | None = None


def _pairs(value: Any) -> Any:
    """Turn a mapping of names to values into pairs in the order of the names."""
    return tuple(sorted(value.items())) if isinstance(value, dict) else value


class UrdfSettings(Chain):
    """The fields of `Urdf`."""

    urdf: File  # the URDF
    meshes: tuple[Mesh, ...] = ()  # of its collision bodies
    srdf: File | None = None  # names pairs of links that are never judged; None: none are named
    # the link, fixed to the ground, whose frame stands at the base; empty: the root
    base_frame: str = ""
    base_position: Point3 = (0.0, 0.0, 0.0)  # where the base stands in the world [m]
    base_rotation: Point3 = (0.0, 0.0, 0.0)  # its roll, pitch, yaw [deg]
    # the link or joint whose frame is the tool's; empty: the tip of the group, or the link
    # farthest down the tree
    tool_frame: str = ""
    joints: tuple[str, ...] = ()  # names of those that move; empty: those of the group, or all
    group: str = ""  # the SRDF's group whose joints move; empty: none
    # the SRDF's groups that are an arm each, the first with all that stands still
    groups: tuple[str, ...] = ()
    # the tool's frame of each of these arms; empty: the tips of the groups
    tool_frames: tuple[str, ...] = ()
    # values of joints that stand still [deg, m]; of others 0, or the limit nearest to it
    fixed: Annotated[tuple[tuple[str, float], ...], BeforeValidator(_pairs)] = ()
    continuous_turns: Positive = 1.0  # how far a continuous joint turns to either side [turns]
    # how far a turning joint does whose limits the URDF does not give [deg]
    turn_limit: Positive = 180.0
    slide_limit: Positive = 1.0  # how far a sliding joint moves to either side, then [m]
    # whether planar and floating joints stand still (fixed) or move (free); or the whole
    # robot moves, as by a planar or floating joint below its root
    base: Literal["fixed", "free", "planar", "floating"] = "fixed"
    # whether meshes are replaced by convex pieces that contain them: by CoACD, or by the
    # convex hull of each; None: they stay as they are
    decomposition: Decomposition | None = None
    # A URDF of spheres, link by link, that cover the bodies in a search; they need not
    # contain them. None: covers are found
    spheres: File | None = None
    # pairs of bodies that need no test, derived when the files are read; None: none are
    pairs: File | None = None

    @property
    def file(self) -> UrdfFile:
        """The URDF."""
        return urdf_file(self.urdf.content)

    @property
    def robot_name(self) -> str:
        """The robot's name in the URDF."""
        return self.file.name

    @property
    def semantics(self) -> Srdf | None:
        """The SRDF; None: there is none."""
        return None if self.srdf is None else Srdf(self.srdf.content, self.file.joints)
