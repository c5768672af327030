"""Several arms as one robot."""

from typing import Annotated, ClassVar

from pydantic import Field

from evoexp.robots.assembly import Chain, Robot


class Arms(Robot):
    """Arms standing in one scene; q is their configurations one after the other.

    Attributes:
        arms: The arms, each with its own base.
    """

    component: ClassVar[str] = "arms"

    arms: Annotated[tuple[Chain, ...], Field(min_length=1)]

    def chains(self) -> tuple[Chain, ...]:
        """Return the arms."""
        return self.arms
