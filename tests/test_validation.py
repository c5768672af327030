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


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"population_size": "eight"},
            "planner.inner.population_size: must be a whole number, was 'eight'",
        ),
        (
            {"population_size": 3.0},
            "planner.inner.population_size: must be a whole number, was 3.0",
        ),
        (
            {"population_size": True},
            "planner.inner.population_size: must be a whole number, was True",
        ),
        ({"population_size": 0}, "planner.inner.population_size: must be at least 1, was 0"),
        ({"rate": 1.5}, "planner.inner.rate: must be at most 1.0, was 1.5"),
        ({"rate": float("nan")}, "planner.inner.rate: must be a finite number, was nan"),
        ({"rate": "0.5"}, "planner.inner.rate: must be a number, was '0.5'"),
        ({"mode": "clampd"}, "did you mean 'clamped'?"),
        ({"rows": [[1, "a"]]}, r"planner.inner.rows[0][1]: must be a number, was 'a'"),
        (
            {"things": [{"shape": "disc", "radius": 0}]},
            "planner.inner.things[0].radius: must be greater than 0",
        ),
        (
            {"things": [{"shape": "dsc", "radius": 0}]},
            "planner.inner.things[0]: must be one of 'disc', 'square'",
        ),
        ({"things": [{"radius": 0}]}, "planner.inner.things[0]: must be given with its 'shape'"),
    ],
)
def test_what_cannot_be_is_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError) as caught:
        make(**settings)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_setting_names_the_nearest() -> None:
    with pytest.raises(UnknownSetting) as caught:
        make(population=5)
    assert "planner.inner.population: unknown setting; did you mean 'population_size'?" in str(
        caught.value
    )


def test_a_missing_setting_is_named() -> None:
    with pytest.raises(SettingError, match="planner.inner.rate: must be given"):
        build({"_target_": "inner", "population_size": 3}, lookup, "planner.inner")


def test_a_scalar_in_place_of_a_component_is_refused() -> None:
    with pytest.raises(SettingError, match="planner.inner: must be a Inner, was 3"):
        build({"_target_": "outer", "inner": 3}, lookup, "planner")


def test_canonical_form_is_built_from_again_and_leaves_defaults_out() -> None:
    outer = make(rows=[[1, 2]], things=[{"shape": "square", "edge": 1}])
    plain = outer.canonical()
    assert plain["revision"] == 3
    assert plain["inner"]["rows"] == [[1.0, 2.0]]
    assert "mode" not in plain["inner"]
    assert build(plain, lookup, "planner") == outer


@pytest.mark.parametrize("value", [1e-101, -1e-320, 1e101, -1e300])
def test_numbers_that_overflow_or_vanish_in_reckoning_are_refused(value: float) -> None:
    with pytest.raises(SettingError, match="planner.x: must be (0, or at least|between)"):
        build({"x": value}, lookup, "planner")


def test_minus_zero_and_zero_are_one_setting() -> None:
    assert str(make(rate=-0.0).inner.rate) == "0.0"


def test_settings_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        make().inner.rate = 0.1


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
