"""Several arms as one robot."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from evoexp.attachments import File
from evoexp.errors import demand
from evoexp.robots.assembly import AppendArm, Assembly, Chain, Robot
from evoexp.validation import TARGET


class Arms(Robot):
    """Arms standing in one scene; q is their configurations one after the other."""

    component: ClassVar[str] = "arms"

    arms: Annotated[tuple[Chain, ...], Field(min_length=1)]  # the arms, each with its own base
    # pairs of bodies that need no test, derived when the files of arms out of a URDF are
    # read; None: none are
    pairs: File | None = None

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether pairs are still to be derived: where an arm comes out of a URDF."""
        arms = settings.get("arms")
        if settings.get("pairs") is not None or not isinstance(arms, list):
            return False
        return any(isinstance(arm, dict) and arm.get(TARGET) == "urdf" for arm in arms)

    def build(self) -> Assembly:
        """Return the robot with its derived pairs."""
        for k, arm in enumerate(self.arms):
            must = "left out for one of several arms"
            demand(not getattr(arm, "spheres", None), f"robot.arms[{k}].spheres", must, "a file")
        return super().build()._replace(pairs=self.pairs.content if self.pairs else None)

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings in which the files that are given count for all arms out of a URDF."""
        settings = dict(settings)
        files = {name: settings.pop(name, None) for name in ("path", "srdf", "packages")}
        shared = {name: path for name, path in files.items() if path is not None}
        if shared and isinstance(arms := settings.get("arms"), list):
            is_urdf = [arm.get(TARGET) == "urdf" for arm in arms]
            arms = [shared | arm if own else arm for arm, own in zip(arms, is_urdf, strict=True)]
            settings["arms"] = arms
        return settings

    def notes(self) -> list[str]:
        """Join the remarks of the arms."""
        return list(dict.fromkeys(note for chain in self.arms for note in chain.notes()))

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arms; a URDF may bring several."""
        return tuple(arm for chain in self.arms for arm in chain.chains())
