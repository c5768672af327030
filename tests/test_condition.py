"""A condition: canonical form, hash, what it refuses, and the names it may use."""

import copy
import importlib.metadata
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from evoexp import registry
from evoexp.condition import Condition, revisions
from evoexp.errors import (
    EvoexpError,
    RegistrationError,
    RevisionMismatch,
    SettingError,
    UnknownSetting,
)
from evoexp.registry import component_class
from evoexp.validation import Component
from evoexp.version import __version__
from guests import on_path, write_distribution
from shipped_conditions import (
    KIND_EXAMPLES,
    different_conditions,
    expanded,
    of_kind,
    shipped_conditions,
)

Path_ = tuple[str | int, ...]

WORDS = (  # that one setting takes
    ("natural", "clamped"),
    ("one_sided", "symmetric"),
    ("genome", "index"),
    ("tails", "segment"),
    ("sum", "larger"),
    ("inverse", "difference"),
    ("threshold", "finite"),
    ("tournament", "roulette", "rank"),
    ("one_point", "uniform", "arithmetic", "blx_alpha"),
    ("non_uniform", "gaussian", "uniform_reset"),
    ("uniform", "gaussian"),
    ("equal", "gaussian"),
    ("comma", "plus"),
    ("gene", "individual"),
    ("chords", "none"),
    ("linear", "cubic"),
    ("binary", "gray"),
    ("left", "right"),
    ("world", "tool"),
    ("go_on", "attach", "detach"),
    ("revolute", "prismatic"),
    ("rad", "deg"),
    ("sine", "step"),
    ("model", "certified", "margin"),
    ("RRTConnect", "RRTstar", "InformedRRTstar", "BITstar"),
)


@pytest.fixture(params=KIND_EXAMPLES)
def shipped(request: pytest.FixtureRequest) -> Condition:
    return of_kind(request.param, "paper")


@pytest.fixture
def config() -> dict[str, Any]:
    """Return one condition as plain data that a test may spoil."""
    return json.loads(expanded("rana_obstacles", "paper").conditions[0].condition.to_json())


def leaves(data: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Yield every setting of plain configuration data and where it stands."""
    items = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
    for key, value in items:
        yield from leaves(value, (*path, key))
    if not isinstance(data, dict | list):
        yield path, data


def with_value(data: Any, path: Path_, value: Any) -> Any:
    changed = copy.deepcopy(data)
    here = changed
    for key in path[:-1]:
        here = here[key]
    here[path[-1]] = value
    return changed


def refusal(config: Any) -> str:
    with pytest.raises(EvoexpError) as caught:
        Condition.from_json(config if isinstance(config, bytes) else json.dumps(config).encode())
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_canonical_form_is_read_back_as_the_same_condition(shipped: Condition) -> None:
    text = shipped.to_json()
    again = Condition.from_json(text)
    assert again == shipped
    assert (again.to_json(), again.id) == (text, shipped.id)
    assert text == json.dumps(json.loads(text), sort_keys=True, separators=(",", ":")).encode()


@pytest.mark.matrix
def test_every_shipped_condition_has_a_hash_of_its_own() -> None:
    everything = shipped_conditions("paper").values()  # experiments share conditions
    different = {c.to_json() for c in everything}
    assert len({c.id for c in everything}) == len(different) == len(different_conditions("paper"))
    assert len(different) > len(everything) // 2


@pytest.mark.examples(2)
def test_every_setting_is_part_of_the_hash(shipped: Condition) -> None:
    """Change each setting by the smallest step that stays valid: another hash, or it is refused.

    Never ignored.
    """
    config = json.loads(shipped.to_json())
    others = {shipped.id}
    count = 0
    for path, value in leaves(config):
        if path[-1] in ("_target_", "revision", "shape") or path[-2:] == ("goal", "kind"):
            continue  # they say which settings are beside them
        count += 1
        steps: list[Any] = [not value] if isinstance(value, bool) else []
        if path[-1] == "sha256":
            steps = ["0" * 64]
        elif isinstance(value, str):
            steps = [word for words in WORDS if value in words for word in words] or [f"{value}m"]
        elif value is None:
            steps = [3]
        elif not steps:
            steps = [value + 1, value - 1, value * 2, value * 0.5, value + 0.05, value * 0.95]
        for step in steps:
            if step == value:
                continue
            try:
                changed = Condition.from_config(with_value(config, path, step))
            except SettingError:
                continue
            assert changed.id not in others, path
            others.add(changed.id)
            break
        else:  # only together with another setting
            named = path[0] == "scenario" and path[-1] in (
                "name",
                "object",
                "then",
            )  # an obstacle and who names it
            assert named or path[-1] in ("hall_frozen", "hall_memory", "hall_distinct"), (
                f"no other value of {path} is accepted"
            )
            ga = config["planner"].get("ga", {})
            assert (
                named
                or ga["hall_depth"] == 0.0
                or ga["hall_frozen"]
                or ga["hall_memory"] is not None
            )
    assert count > 20


@pytest.mark.examples(2)
def test_whole_numbers_and_floats_are_one_setting(shipped: Condition) -> None:
    config = json.loads(shipped.to_json())
    for path, value in leaves(config):
        if isinstance(value, float) and value.is_integer():
            assert Condition.from_config(with_value(config, path, int(value))).id == shipped.id
        if value == 0.0 and isinstance(value, float):
            assert Condition.from_config(with_value(config, path, -0.0)).id == shipped.id


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        (
            "robot",
            {"_target_": "os.system", "command": "true"},
            "robot._target_: must be a registered component, was 'os",
        ),
        (
            "robot",
            {"_target_": "armz"},
            "robot._target_: must be a registered component, was 'armz'; did you mean 'arms'?",
        ),
        ("robot", {}, "robot: must be a component, given by its _target_, was {}"),
        ("robot", None, "robot: must be a component, given by its _target_, was None"),
        ("robot", [1], "robot: must be a component, given by its _target_, was [1]"),
        ("seed", "0", "seed: must be a whole number, at least 0, was '0'"),
        ("seed", True, "seed: must be a whole number, at least 0, was True"),
        ("seed", -1, "seed: must be a whole number, at least 0, was -1"),
        ("seed", None, "seed: must be a whole number, at least 0, was None"),
        ("sead", 1, "sead: unknown setting; did you mean 'seed'?"),
    ],
)
def test_parts_that_cannot_be(config: dict[str, Any], part: str, value: Any, message: str) -> None:
    assert message in refusal(config | {part: value})


def test_components_in_the_wrong_place_are_refused(config: dict[str, Any]) -> None:
    robot, scenario, planner = config["robot"], config["scenario"], config["planner"]
    assert (
        refusal(config | {"robot": scenario})
        == "robot: must be one that via_point_ga takes (Robot), was 'arm_motion'"
    )
    assert (
        refusal(config | {"scenario": robot}) == "scenario: must be one that via_point_ga takes "
        "(ArmMotion or LinkMotion or MoveitTask or GridMotion), was 'arms'"
    )
    assert refusal(config | {"planner": robot}) == "planner: must be a planner, was 'arms'"
    search = {"_target_": "random_search", "revision": 1}
    assert (
        refusal(config | {"planner": search | {"planner": 3}})
        == "planner: must be a planner, was 3"
    )
    assert "scenario: must be one that via_point_ga" in refusal(
        config | {"planner": search | {"planner": planner}, "scenario": robot}
    )
    assert refusal(config | {"planner": planner | {"ga": robot}}).startswith(
        "planner.ga: must be a GeneticSettings"
    )


@pytest.mark.parametrize("value", [{}, [], None, 3])
def test_a_component_without_a_name_is_refused(config: dict[str, Any], value: Any) -> None:
    named = "must be a component, given by its _target_, was"
    arms = [*config["robot"]["arms"][:-1], value]
    changed = config | {"robot": config["robot"] | {"arms": arms}}
    assert refusal(changed).startswith(f"robot.arms[{len(arms) - 1}]: {named}")
    changed = config | {"planner": config["planner"] | {"ga": value}}
    assert refusal(changed).startswith("planner.ga")  # or the first setting that is missing


def test_a_refusal_is_a_line_that_can_be_read(config: dict[str, Any]) -> None:
    arms = [{"_target_": "planar_chain", "revision": 9}] * 5000
    assert len(refusal(config | {"robot": config["robot"] | {"arms": arms}})) < 1300
    assert len(refusal(config | {"robot": {"_target_": "x" * 5000}})) < 1500


@pytest.mark.parametrize(
    "text",
    [b"", b"{", b"[]", b"3", b"null", b"\xff\xfe", b"[" * 100_000, b'{"robot": ' * 100_000],
    ids=["empty", "cut", "list", "number", "null", "no text", "deep list", "deep mapping"],
)
def test_a_text_that_is_no_condition_is_refused(text: bytes) -> None:
    assert "config.json: must be a condition in JSON" in refusal(text)


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-Infinity"])
def test_numbers_that_are_none_are_refused(config: dict[str, Any], value: str) -> None:
    text = json.dumps(
        with_value(config, ("planner", "walk_step"), float(value.replace("Infinity", "inf")))
    )
    assert value in text
    assert refusal(text.encode()).startswith("planner.walk_step: must be a finite number")


def test_another_revision_is_refused_and_names_both(config: dict[str, Any]) -> None:
    config["planner"]["ga"]["revision"] = 7
    with pytest.raises(RevisionMismatch, match=r"planner.ga was revision 7, installed is 1"):
        Condition.from_json(json.dumps(config).encode())


def test_revisions_are_listed_for_every_component(shipped: Condition) -> None:
    found = {
        field: (stored, installed)
        for field, stored, installed in revisions(json.loads(shipped.to_json()))
    }
    arms = {"robot.arms[0]"} if hasattr(shipped.robot, "arms") else set()
    assert {"robot", "scenario", "planner"} | arms <= set(found)
    assert all(stored == installed for stored, installed in found.values())


def test_an_unknown_setting_in_a_stored_configuration_is_refused(config: dict[str, Any]) -> None:
    config["planner"]["ga"]["population_sise"] = 3
    with pytest.raises(
        UnknownSetting,
        match="planner.ga.population_sise: unknown setting; did you mean 'population_si",
    ):
        Condition.from_json(json.dumps(config).encode())


def test_a_planner_that_lacks_something_of_the_protocol_is_refused_by_name(
    tmp_path: Path, config: dict[str, Any]
) -> None:
    (tmp_path / "lacking_planner.py").write_text(
        "from typing import ClassVar\nfrom evoexp.validation import Component\n"
        "class Half(Component):\n    component: ClassVar[str] = 'half'\n"
        "    num_generations: int = 1\n"
        "    def prepare(self, robot, scenario): return None\n"
        "    def evolve(self, problem, rng): yield from ()\n"
    )
    write_distribution(tmp_path, "half", components={"half": "lacking_planner:Half"})
    with on_path(tmp_path):
        text = refusal(config | {"planner": {"_target_": "half", "revision": 1}})
    assert text.startswith("planner: must be a planner; lacking_planner.Half lacks ")
    assert text.endswith("was 'half'")
    lacking = text.partition(" lacks ")[2].partition(", was ")[0].split(", ")
    assert {"reproducibility", "sample", "cost", "motion", "shape", "notes"} <= set(lacking)
    assert not {"component", "revision", "prepare", "evolve", "num_generations"} & set(lacking)


def test_replicates_have_streams_of_their_own_that_conditions_share() -> None:
    first, other, _ = (c for _, c in expanded("rana_planar", "paper").conditions)
    draws = [condition.rng(k).random(3).tolist() for condition in (first, other) for k in (0, 1)]
    assert draws[:2] == draws[2:]
    assert draws[0] != draws[1]
    assert first._replace(seed=1).rng(0).random() != draws[0][0]


# The registry


@pytest.mark.parametrize("name", registry.names(registry.COMPONENTS))
def test_registered_names_are_the_components_own(name: str) -> None:
    kind = component_class(name)
    assert issubclass(kind, Component)
    assert kind.component == name


@pytest.fixture
def guest(tmp_path: Path) -> Iterator[Path]:
    """Have two components of a guest's module on the path, which nobody registers yet."""
    (tmp_path / "guest_module.py").write_text(
        "from evoexp.evolution.genetic_settings import GeneticSettings\n"
        "class Mine(GeneticSettings):\n    component = 'my_plug_in'\n"
    )
    with on_path(tmp_path):
        yield tmp_path


def test_an_installed_package_registers_components(guest: Path, config: dict[str, Any]) -> None:
    names = dict.fromkeys(("my_plug_in", "my_plug_in_too"), "guest_module:Mine")
    write_distribution(guest, "My.plug-in", components=names)
    registry.clear()
    config["planner"]["ga"]["_target_"] = "my_plug_in"
    mine = Condition.from_config(config)
    assert type(mine.planner.ga).__name__ == "Mine"  # type: ignore[attr-defined]
    assert registry.guests(mine.to_json()) == {"my_plug_in": "My.plug-in 1.0"}
    assert component_class("my_plug_in_too") is type(mine.planner.ga)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine", "mine: plug-in 1.0 must register names that begin with its own, 'plug_in' or 'pl"),
        ("plug_inn", "plug_inn: plug-in 1.0 must register names that begin with its own"),
        ("genetic", f"genetic: registered by evoexp {__version__} and plug-in 1.0; uninstall"),
        ("plug_in_lost", "plug_in_lost: plug-in 1.0 registers guest_module:Lost, which cannot be"),
        ("plug_in_gone", "plug_in_gone: plug-in 1.0 registers no_such_module:A, which cannot be"),
    ],
)
def test_a_package_that_registers_wrongly_is_named(guest: Path, name: str, message: str) -> None:
    targets = {"plug_in_lost": "guest_module:Lost", "plug_in_gone": "no_such_module:A"}
    write_distribution(guest, "plug-in", components={name: targets.get(name, "guest_module:Mine")})
    registry.clear()
    with pytest.raises(RegistrationError) as caught:
        component_class(name)
    assert str(caught.value).startswith(message)
    assert component_class("arms").component == "arms"  # other names are as good as before


def test_two_guests_of_one_name_are_both_named(guest: Path) -> None:
    write_distribution(guest, "plug", "2.0", components={"plug_in": "guest_module:Mine"})
    write_distribution(guest, "plug-in", "1.0", components={"plug_in": "guest_module:Mine"})
    registry.clear()
    with pytest.raises(RegistrationError, match="registered by plug 2.0 and plug-in 1.0"):
        component_class("plug_in")


def test_without_its_metadata_evoexp_says_that_it_is_not_installed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(importlib.metadata, "distributions", lambda: iter(()))
    registry.clear()
    with pytest.raises(RegistrationError, match="evoexp: is not installed"):
        component_class("arms")
    registry.clear()
