"""Settings: what cannot be is refused in one line that names the field."""

from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from evoexp.errors import EvoexpError, SettingError, UnknownSetting
from evoexp.validation import Component, Count, Rate, Settings, Vector, build


class Disc(Settings):
    shape: Literal["disc"]
    radius: Annotated[float, Field(gt=0.0)]


class Square(Settings):
    shape: Literal["square"]
    edge: float


class Inner(Component):
    component = "inner"
    population_size: Count
    rate: Rate
    mode: Literal["natural", "clamped"] = "natural"
    rows: tuple[Vector, ...] = ()
    things: tuple[Annotated[Disc | Square, Field(discriminator="shape")], ...] = ()


class Outer(Component):
    component = "outer"
    revision = 3
    inner: Inner


def lookup(name: str, field: str) -> type[Component]:
    return {"inner": Inner, "outer": Outer}[name]


def make(**settings: object) -> Outer:
    inner = {"_target_": "inner", "population_size": 3, "rate": 0.5} | settings
    return build({"_target_": "outer", "inner": inner}, lookup, "planner")


INNER = "planner.inner"
WRONG: list[tuple[dict[str, object], str]] = [
    ({"population_size": "eight"}, f"{INNER}.population_size: must be a whole number, was 'eight'"),
    ({"population_size": 3.0}, f"{INNER}.population_size: must be a whole number, was 3.0"),
    ({"population_size": True}, f"{INNER}.population_size: must be a whole number, was True"),
    ({"population_size": 0}, f"{INNER}.population_size: must be at least 1, was 0"),
    ({"rate": 1.5}, f"{INNER}.rate: must be at most 1.0, was 1.5"),
    ({"rate": float("nan")}, f"{INNER}.rate: must be a finite number, was nan"),
    ({"rate": "0.5"}, f"{INNER}.rate: must be a number, was '0.5'"),
    ({"mode": "clampd"}, "did you mean 'clamped'?"),
    ({"rows": [[1, "a"]]}, f"{INNER}.rows[0][1]: must be a number, was 'a'"),
    ({"things": [{"shape": "disc", "radius": 0}]}, ".things[0].radius: must be greater than 0"),
    ({"things": [{"shape": "dsc"}]}, f"{INNER}.things[0]: must be one of 'disc', 'square'"),
    ({"things": [{"radius": 0}]}, f"{INNER}.things[0]: must be given with its 'shape'"),
    ({"population": 5}, f"{INNER}.population: unknown setting; did you mean 'population_size'?"),
]


@pytest.mark.parametrize(("settings", "message"), WRONG)
def test_what_cannot_be_is_refused(settings: dict[str, object], message: str) -> None:
    kind = UnknownSetting if "unknown" in message else SettingError
    with pytest.raises(kind) as caught:
        make(**settings)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"_target_": "inner", "population_size": 3}, "planner.rate: must be given"),
        ({"_target_": "outer", "inner": 3}, "planner.inner: must be a Inner, was 3"),
        *(({"x": v}, "planner.x: must be (0, or at least|between)") for v in (1e-101, -1e-320)),
        *(({"x": v}, "planner.x: must be (0, or at least|between)") for v in (1e101, -1e300)),
    ],
)
def test_configurations_that_cannot_be(config: dict[str, object], message: str) -> None:
    """A missing setting, a scalar for a component, numbers that overflow or vanish in reckoning."""
    with pytest.raises(SettingError, match=message):
        build(config, lookup, "planner")


def test_canonical_form_is_built_from_again_and_leaves_defaults_out() -> None:
    outer = make(rows=[[1, 2]], things=[{"shape": "square", "edge": 1}])
    plain = outer.canonical()
    assert plain["revision"] == 3
    assert plain["inner"]["rows"] == [[1.0, 2.0]]
    assert "mode" not in plain["inner"]
    assert build(plain, lookup, "planner") == outer


def test_settings_are_frozen_and_minus_zero_is_zero() -> None:
    inner = make(rate=-0.0).inner
    assert str(inner.rate) == "0.0"
    with pytest.raises(ValueError, match="frozen"):
        inner.rate = 0.1


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda children: (
        st.lists(children, max_size=3) | st.dictionaries(st.text(max_size=5), children, max_size=3)
    ),
    max_leaves=5,
)


@given(JSON, st.sampled_from(["population_size", "rate", "mode", "rows", "things", "new"]))
def test_any_value_is_taken_or_refused_in_one_line(value: object, name: str) -> None:
    try:
        outer = make(**{name: value})
    except EvoexpError as error:
        assert "\n" not in str(error) or "\n" in repr(value)
        assert f"planner.inner.{name}" in str(error)
    else:
        assert build(outer.canonical(), lookup, "planner") == outer
