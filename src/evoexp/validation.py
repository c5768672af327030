"""The base of every component: typed, frozen, checked settings.

A component is a class whose fields are its settings. Building one from plain data (read from a YAML
file or from the `config.json` of a log) checks every type and range and names the offending field
by its path; nothing is coerced but whole numbers into float fields and lists into tuples.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from evoexp.errors import SettingError, UnknownSetting, demand, nearest

# Counts beyond a thousand million are slips, and overflow where kernels multiply them.
MAX_COUNT = 10**9
# Squares and products of larger numbers overflow; no length, angle or weight comes near.
LARGEST = 1e100
SMALLEST = 1e-100  # besides 0: the reciprocal of a smaller number overflows, or its square vanishes

Count = Annotated[int, Field(ge=1, le=MAX_COUNT)]  # at least 1, at most a thousand million
NonNegativeCount = Annotated[int, Field(ge=0, le=MAX_COUNT)]
# Configurations of a path, pieces of a segment: laid out one by one before anything is run.
LayoutCount = Annotated[int, Field(ge=1, le=10_000)]
Rate = Annotated[float, Field(ge=0.0, le=1.0)]  # a probability or share in [0, 1]
Positive = Annotated[float, Field(gt=0.0)]  # above 0
NonNegative = Annotated[float, Field(ge=0.0)]  # 0 or above
Vector = tuple[float, ...]


def _with_room(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise PydanticCustomError("no_room", "[least, greatest] with least < greatest")
    return limits


Limits = Annotated[tuple[float, float], AfterValidator(_with_room)]
"""Least and greatest value, with room between them."""

TARGET = "_target_"
MOST_QUERIES = "max_collision_queries"  # of a condition; left out where nothing is capped


class Settings(BaseModel):
    """Frozen, strictly typed settings that are part of a component, such as an obstacle."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    def model_post_init(self, context: Any) -> None:
        """Check the fields together, once each of them is valid."""
        self._check()

    def _check(self) -> None:
        """Refuse fields that contradict each other by a SettingError."""

    def demand(self, field: str, holds: bool, must: str) -> None:
        """Refuse these settings unless a condition on a field holds.

        Raises:
            SettingError: If it does not.
        """
        demand(holds, field, must, getattr(self, field))

    def canonical(self) -> dict[str, Any]:
        """Return the settings as plain data: the form that is hashed, stored and built from again.

        A field that has a default was added after the first release, or is an extension that a
        paper's own configuration leaves off; at its default it is left out, so that older
        identities stay as they were.
        """
        fields = type(self).model_fields
        return {
            name: _plain(getattr(self, name))
            for name, field in fields.items()
            if field.is_required() or getattr(self, name) != field.get_default()
        }


AnySettings = TypeVar("AnySettings", bound=Settings)


class Component(Settings):
    """Settings with a registered name, which `_target_` in a YAML option refers to.

    A class of evoexp that gives itself no name has its class's: `OnePoint` is `one_point`. Bases of
    several components have none, and say so: `class Crossover(Operator, is_base=True)`.
    """

    component: ClassVar[str]  # the registered name
    # raised whenever the same settings give other results than before; part of every identity
    revision: ClassVar[int] = 1

    def __init_subclass__(cls, is_base: bool = False, **options: Any) -> None:
        """Name a component of evoexp; a guest's name begins with that of its distribution."""
        super().__init_subclass__(**options)
        if cls.__module__.startswith("evoexp.") and not is_base and "component" not in vars(cls):
            cls.component = re.sub("(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    @model_validator(mode="before")
    @classmethod
    def _names_its_component(cls, settings: Any) -> Any:
        """Refuse settings without a name where only the base of several components is known."""
        if not hasattr(cls, "component") and not isinstance(settings, cls):
            must = "a component, given by its {target}"
            raise PydanticCustomError("unnamed", must, {"target": TARGET})
        return settings

    def canonical(self) -> dict[str, Any]:
        """Return the settings with the component's name and revision."""
        return {TARGET: self.component, "revision": self.revision} | super().canonical()


def build(
    data: Any, lookup: Callable[[str, str], type[Component]], field: str, largest: float = LARGEST
) -> Any:
    """Build plain data into components, the innermost first.

    Args:
        data: A mapping with `_target_`, or any nesting of mappings, lists and scalars around such
            mappings.
        lookup: Returns the class of a registered name; its error names the field.
        field: Dotted path of `data`, for errors.
        largest: Largest absolute value of a number.
    """
    if isinstance(data, Mapping):
        children = {
            key: build(value, lookup, _join(field, str(key)), largest)
            for key, value in data.items()
            if key != TARGET
        }
        if TARGET not in data:
            return children
        children.pop("revision", None)  # as stored; whoever reads a stored one compares it
        return construct(lookup(str(data[TARGET]), field), children, field)
    if isinstance(data, list | tuple):
        return tuple(build(value, lookup, f"{field}[{k}]", largest) for k, value in enumerate(data))
    if isinstance(data, int | float):
        return _number(data, field, largest)
    return data


def _number(value: float, field: str, largest: float) -> float:
    """Return a number, true or false to reckon with; NaN and infinities are left to the field."""
    if isinstance(value, float):
        if largest < abs(value) < math.inf:
            raise SettingError(field, f"between -{largest:g} and {largest:g}", value)
        if 0.0 < abs(value) < SMALLEST:
            raise SettingError(field, f"0, or at least {SMALLEST:g} in size", value)
        return value + 0.0  # -0.0 and 0.0 are one setting
    if abs(value) > min(largest, 2**62):
        most = f"{min(largest, 1e18):g}"
        bits = value.bit_length()
        was = value if bits < 1000 else f"one of some {bits * 3 // 10}"  # of its digits
        raise SettingError(field, f"between -{most} and {most}", was)
    return value


def construct(kind: type[AnySettings], values: Mapping[str, Any], field: str) -> AnySettings:
    """Return settings of a kind; an error names their field."""
    try:
        return kind(**values)
    except ValidationError as error:
        raise _settings_error(kind, error, values, field) from None
    except SettingError as error:
        path = _join(field, error.field)
        raise SettingError(path, error.must, error.was, error.hint) from None


def _settings_error(
    kind: type[Settings], error: ValidationError, settings: Any, field: str
) -> SettingError | UnknownSetting:
    """Return the first thing that is wrong with settings, which a class refused, as one line."""
    first = error.errors(include_url=False)[0]
    path, here, kinds = field, settings, {kind}
    for part in first["loc"]:
        kinds = _inner(kinds, part)
        if isinstance(part, int) and isinstance(here, list | tuple):
            path, here = f"{path}[{part}]", here[part] if part < len(here) else {}
        elif isinstance(part, int):  # one value in the place of a list
            continue
        elif part in _members(here) or (part == first["loc"][-1] and "[" not in part):
            path, here = _join(path, part), _members(here).get(part, {})
        # else: the tag of a union, which nobody typed
        unknown = first["type"] == "extra_forbidden" and part == first["loc"][-1]
        component = any(issubclass(k, Component) for k in kinds)
        if isinstance(here, Mapping) and here and component and not unknown:
            return SettingError(path, f"a component, given by its {TARGET}", here)
    if first["type"] == "extra_forbidden":
        return UnknownSetting(path, {name for each in kinds for name in each.model_fields})
    if first["type"] == "missing":
        return SettingError(path, "given", None)
    must, hint = _must(first)
    if first["type"] == "model_type" and not any(issubclass(k, Component) for k in kinds):
        names = {name for each in kinds for name in each.model_fields}
        must = f"a mapping of {', '.join(sorted(names))}"
    was = first["input"]
    return SettingError(path, must, list(was) if isinstance(was, tuple) else was, hint)


def _members(value: Any) -> Mapping[str, Any]:
    if isinstance(value, Settings):
        return vars(value)
    return value if isinstance(value, Mapping) else {}


def _inner(kinds: set[type[Settings]], part: int | str) -> set[type[Settings]]:
    inner = {
        own
        for each in kinds
        if part in each.model_fields
        for own in _settings_in(each.model_fields[str(part)].annotation)
    }
    # words by which a union may tell a class from others
    words = {each: [field.annotation for field in each.model_fields.values()] for each in kinds}
    tagged = {each for each in kinds if any(part in get_args(word) for word in words[each])}
    is_leaf = any(part in each.model_fields for each in kinds)
    return inner if is_leaf else tagged or kinds


def _settings_in(annotation: Any) -> Iterator[type[Settings]]:
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        yield annotation
    for inner in get_args(annotation):
        yield from _settings_in(inner)


_MUST = {
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "string_type": "text",
    "tuple_type": "a list",
    "greater_than_equal": "at least {ge}",
    "greater_than": "greater than {gt}",
    "less_than_equal": "at most {le}",
    "less_than": "less than {lt}",
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
    "literal_error": "one of {expected}",
    "union_tag_invalid": "one of {expected_tags}",
    "union_tag_not_found": "given with its {discriminator}",
    "model_type": "a {class_name}",
    "model_attributes_type": "a mapping",
    "is_instance_of": "a component that is a {class}",
}


def _must(error: Any) -> tuple[str, str]:
    context = error.get("ctx", {})
    template = _MUST.get(error["type"])
    must, hint = template.format(**context) if template else str(error["msg"]), ""
    if error["type"] == "literal_error" and isinstance(error["input"], str):
        expected = context["expected"].replace("'", "").replace(" or ", ", ").split(", ")
        hint = nearest(error["input"], expected)
    return must, hint


def _plain(value: Any) -> Any:
    if isinstance(value, Settings):
        return value.canonical()
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value


def _join(field: str, name: str) -> str:
    return f"{field}.{name}" if field else name
