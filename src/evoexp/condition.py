"""A condition: everything that can change a result, as one typed value with a hash."""

import contextlib
import functools
import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import UnionType
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np

from evoexp.attachments import FILE, SHA256, attached, keep, read
from evoexp.errors import EvoexpError, RevisionMismatch, SettingError, UnknownSetting, brief, demand
from evoexp.registry import component_class, components_in
from evoexp.validation import LARGEST, MOST_QUERIES, TARGET, Component, build

# Of robots and scenarios: coal's distances between bodies ten times as far apart or as large as
# that end in memory that is not theirs.
_LARGEST = {"robot": 1e7, "scenario": 1e7, "planner": LARGEST}
MAX_SEED = 2**128  # numpy's own seeds have as many bits
PARTS = ("robot", "scenario", "planner")
KEYS = (*PARTS, "seed", MOST_QUERIES)
LARGEST_CAP = 10**15  # collision queries: as many as a float tells apart
_pairs: dict[str, bytes] = {}  # a robot's settings → its derived pairs


def read_files(
    config: Any, folders: Sequence[Path], adjust: Callable[[Any], Any] = lambda config: config
) -> Any:
    """Return plain data with the contents' hashes in the place of paths; the contents are kept.

    Besides `{file: path}`, components may have files of their own: those have a class method
    `read_files(settings, field)`. Only what a user typed is read; what a log holds names no paths.

    Args:
        config: Any nesting of mappings, lists and scalars.
        folders: Where paths are looked for that are not there from the current directory.
        adjust: Changes the data once files are read, before pairs of the robot's bodies are
            derived: by what a file of the scenario says of the robot.
    """
    config = adjust(_with_contents(config, folders, ""))
    # derive the pairs of the robot's bodies that need no test
    robot = config.get("robot") if isinstance(config, dict) else None
    if not isinstance(robot, dict) or not isinstance(robot.get(TARGET), str):
        return config
    kind: Any = component_class(robot[TARGET], "robot")
    if not hasattr(kind, "wants_pairs") or not kind.wants_pairs(robot):
        return config
    text = json.dumps(robot, sort_keys=True, default=str)
    if text not in _pairs:
        from evoexp.collision.derived_pairs import derive_pairs  # and coal, for URDFs only

        try:
            built = build(robot, component_class, "robot", _LARGEST["robot"]).build()
        except EvoexpError:  # said where the robot is needed
            return config
        _pairs[text] = derive_pairs(built).to_json()
    return {**config, "robot": {**robot, "pairs": {SHA256: keep(_pairs[text])}}}


def _with_contents(value: Any, folders: Sequence[Path], field: str) -> Any:
    """Return plain data with hashes of contents, where it names files and components read files."""
    if isinstance(value, list):
        return [_with_contents(item, folders, f"{field}[{k}]") for k, item in enumerate(value)]
    if not isinstance(value, dict):
        return value
    if set(value) == {FILE}:
        return {SHA256: read(value[FILE], folders, f"{field}.{FILE}")}
    if isinstance(value.get(TARGET), str):
        reads = getattr(component_class(value[TARGET], field), "read_files", None)
        value = reads(value, field) if reads is not None else value
    return {
        key: _with_contents(item, folders, f"{field}.{key}" if field else str(key))
        for key, item in value.items()
    }


def stored_config(text: bytes) -> dict[str, Any]:
    """Return the plain data of the canonical form that a run or a log stores, of any revision."""
    try:
        config: dict[str, Any] = json.loads(text)
    except (ValueError, RecursionError):
        raise SettingError("config.json", "a condition in JSON", text[:40]) from None
    demand(isinstance(config, dict), "config.json", "a condition in JSON", config)
    for part in PARTS:
        named, must = config.get(part), f"a component, given by its {TARGET}"
        is_named = isinstance(named, dict) and isinstance(named.get(TARGET), str)
        demand(is_named, f"config.json: {part}", must, named)
    if unknown := set(config) - {*KEYS}:
        raise UnknownSetting(min(unknown), KEYS)
    return config


class Prepared(NamedTuple):
    """A condition ready to run: its planner and the problem that the planner prepared."""

    planner: Any
    problem: Any


class Condition(NamedTuple):
    """All that can change a result: robot, scenario, planner with its parts, seed, and a cap."""

    robot: Component  # a component
    scenario: Component  # a component
    planner: Any  # a component that is a `planners.planner.Planner`
    seed: int  # at least 0
    # a run ends before the generation that takes it beyond; None: no cap
    max_collision_queries: int | None = None

    @classmethod
    def from_config(cls, config: Any) -> "Condition":
        """Build a condition from plain data with `KEYS`, the last of which may be left out."""
        if unknown := set(config) - {*KEYS}:
            raise UnknownSetting(min(unknown), KEYS)
        parts = [build(config.get(part), component_class, part, _LARGEST[part]) for part in PARTS]
        for part, value in zip(PARTS, parts, strict=True):
            must = f"a component, given by its {TARGET}"
            demand(isinstance(value, Component), part, must, config.get(part))
        seed, most = config.get("seed"), config.get(MOST_QUERIES)
        demand(type(seed) is int and seed >= 0, "seed", "a whole number, at least 0", seed)
        demand(seed < MAX_SEED, "seed", "less than 2^128", seed)
        is_cap = most is None or (type(most) is int and 0 < most <= LARGEST_CAP)
        demand(is_cap, MOST_QUERIES, f"a whole number, 1 to {LARGEST_CAP:,}", most)
        robot, scenario, planner = parts
        _check_roles(robot, scenario, planner)
        return cls(robot, scenario, planner, seed, most)

    @classmethod
    def from_json(cls, text: bytes) -> "Condition":
        """Build a condition from the canonical form that a run or a log stores.

        Raises:
            RevisionMismatch: If a component has another revision in this installation.
            SettingError: If the text is no condition.
        """
        config = stored_config(text)
        stale = [
            f"{field} was revision {str(stored)[:20]}, installed is {installed}"
            for field, stored, installed in revisions(config)
            if stored != installed
        ]
        if stale:
            raise RevisionMismatch(brief("; ".join(stale)))
        return cls.from_config(config)

    def to_json(self) -> bytes:
        """Return the canonical form, whose SHA-256 is the identity: keys sorted, floats short."""
        config = {part: getattr(self, part).canonical() for part in PARTS} | {"seed": self.seed}
        if self.max_collision_queries is not None:
            config[MOST_QUERIES] = self.max_collision_queries
        return json.dumps(config, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()

    def files(self) -> dict[str, bytes]:
        """Return the contents of the files that it refers to, by their names in a log."""
        return attached({part: getattr(self, part).canonical() for part in PARTS})

    @property
    def id(self) -> str:
        """64 hex digits; 12 are shown, any unique prefix is accepted."""
        return hashlib.sha256(self.to_json()).hexdigest()

    @property
    def length_unit(self) -> str:
        """Unit of every length in the results, as the scenario names it."""
        return str(getattr(self.scenario, "length_unit", ""))

    @property
    def is_reference(self) -> bool:
        """Whether this is a reference: a truth that needs no seed, and one replicate."""
        return bool(self.planner.is_reference)

    @property
    def reproducibility(self) -> str:
        """`environment` if that of the planner, or of a planner in it, is; else `bits`."""
        all_bits = all(planner.reproducibility == "bits" for planner in _nested(self.planner))
        return "bits" if all_bits else "environment"

    def num_replicates(self, asked: int) -> int:
        """Return the number of replicates of this condition: one of a reference, else as asked."""
        return 1 if self.is_reference else asked

    def rng(self, replicate: int) -> np.random.Generator:
        """Return the replicate's generator: equal seeds give equal streams to all conditions."""
        seeds = np.random.SeedSequence(self.seed, spawn_key=(replicate,))
        return np.random.Generator(np.random.PCG64(seeds))

    @functools.lru_cache(maxsize=64)  # noqa: B019  # conditions are values
    def prepare(self) -> Prepared:
        """Build the robot, check the scenario against it, and let the planner prepare, once.

        Raises:
            SettingError: If the parts contradict each other (a start in collision, say).
        """
        return Prepared(self.planner, self.planner.prepare(self.robot, self.scenario))

    def notes(self) -> list[str]:
        """Return the remarks of robot, planner and scenario, one per line."""
        from evoexp.robots.assembly import Robot  # and Pinocchio

        planner, problem = self.prepare()
        of_scenario = getattr(self.scenario, "notes", None)
        return [
            *(self.robot.notes() if isinstance(self.robot, Robot) else ()),
            *planner.notes(problem),
            *(of_scenario(self.robot) if callable(of_scenario) else ()),
        ]


def _nested(planner: Any) -> Iterator[Any]:
    """Yield a planner and those that it stands beside, the outermost first."""
    yield planner
    if isinstance(planner, Component) and "planner" in type(planner).model_fields:
        yield from _nested(getattr(planner, "planner"))  # noqa: B009  # a field of the planner


def _check_roles(robot: Component, scenario: Component, planner: Component) -> None:
    """Refuse a planner that is none, or that takes no such robot or scenario."""
    from evoexp.planners.planner import MEMBERS  # and pinocchio, which `evoexp list` needs not

    *_, inner = planners = list(_nested(planner))
    for each in planners:
        is_planner = isinstance(each, Component) and hasattr(each, "prepare")
        demand(is_planner, "planner", "a planner", getattr(each, "component", each))
        kind = type(each)
        lacking = [m for m in MEMBERS if m not in kind.model_fields and not hasattr(kind, m)]
        must = f"a planner; {kind.__module__}.{kind.__qualname__} lacks {', '.join(lacking)}"
        demand(not lacking, "planner", must, each.component)
    with contextlib.suppress(NameError):  # of a type that is not imported when the planner runs
        hints = get_type_hints(inner.prepare)
        for part, value in (("robot", robot), ("scenario", scenario)):
            hint = hints.get(part, Any)
            if isinstance(hint, type | UnionType) and not isinstance(value, hint):
                kinds = " or ".join(each.__name__ for each in get_args(hint) or (hint,))
                must = f"one that {inner.component} takes ({kinds})"
                raise SettingError(part, must, value.component)


def revisions(config: Any) -> Iterator[tuple[str, Any, int]]:
    """Yield (field, stored revision, installed revision) of every component in plain data."""
    for field, settings in components_in(config):
        kind = component_class(str(settings[TARGET]), field or "config")
        yield field or "config", settings.get("revision"), kind.revision
