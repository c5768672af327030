"""A condition: canonical form, hash, what it refuses, and the names it may use."""

import copy
import importlib.metadata
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from evoexp import errors, registry
from evoexp.condition import Condition, revisions
from evoexp.errors import EvoexpError, RegistrationError, RevisionMismatch, UnknownSetting
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

SOURCE = Path(__file__).parents[1] / "src" / "evoexp"
Path_ = tuple[str | int, ...]

TAKEN = """natural clamped, one_sided symmetric, genome index, tails segment, sum larger,
inverse difference, threshold finite, tournament roulette rank, gene individual, rad deg, sine step,
one_point uniform arithmetic blx_alpha, non_uniform gaussian uniform_reset, uniform gaussian,
equal gaussian, comma plus, chords none, linear cubic, binary gray, left right, world tool,
go_on attach detach, revolute prismatic, model certified margin,
RRTConnect RRTstar InformedRRTstar BITstar"""
WORDS = [words.split() for words in TAKEN.split(",")]  # that one setting takes


@pytest.fixture(params=KIND_EXAMPLES)
def shipped(request: pytest.FixtureRequest) -> Condition:
    return of_kind(request.param, "paper")


@pytest.fixture
def config() -> dict[str, Any]:
    """Return one condition as plain data that a test may spoil."""
    return json.loads(expanded("rana_obstacles", "paper").conditions[0].condition.to_json())


def leaves(data: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Yield every setting of plain configuration data and where it stands."""
    if not isinstance(data, dict | list):
        yield path, data
        return
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield from leaves(value, (*path, key))


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


def other_values(name: Any, value: Any) -> list[Any]:
    """Return values of which one is valid in the place of a setting's."""
    if name == "sha256":
        return ["0" * 64]
    if isinstance(value, str):
        every = [word for words in WORDS if value in words for word in words]
        return [word for word in every if word != value] or [f"{value}m"]
    if value is None or isinstance(value, bool):
        return [3 if value is None else not value]
    return [value + 1, value - 1, value * 2, value * 0.5, value + 0.05, value * 0.95]


@pytest.mark.examples(2)
def test_every_setting_is_part_of_the_hash(shipped: Condition) -> None:
    """Change each setting by the smallest step that stays valid: another hash, or it is refused."""
    config, others, count = json.loads(shipped.to_json()), {shipped.id}, 0
    ga = config["planner"].get("ga", {})
    for path, value in leaves(config):
        if path[-1] in ("_target_", "revision", "shape") or path[-2:] == ("goal", "kind"):
            continue  # they say which settings are beside them
        count += 1
        for step in other_values(path[-1], value):
            if step == value:
                continue
            try:
                changed = Condition.from_config(with_value(config, path, step))
            except errors.SettingError:
                continue
            assert changed.id not in others, path
            others.add(changed.id)
            break
        else:  # only together with another setting: an obstacle and who names it, the hall
            if path[0] != "scenario" or path[-1] not in ("name", "object", "then"):
                hall = ("hall_frozen", "hall_memory", "hall_distinct")
                assert path[-1] in hall, f"no other value of {path} is accepted"
                kept = ga["hall_frozen"] or ga["hall_memory"] is not None
                assert kept or ga["hall_depth"] == 0.0
    assert count > 20


@pytest.mark.examples(2)
def test_whole_numbers_and_floats_are_one_setting(shipped: Condition) -> None:
    config = json.loads(shipped.to_json())
    for path, value in leaves(config):
        if isinstance(value, float) and value.is_integer():
            assert Condition.from_config(with_value(config, path, int(value))).id == shipped.id
        if value == 0.0 and isinstance(value, float):
            assert Condition.from_config(with_value(config, path, -0.0)).id == shipped.id


UNNAMED = "must be a component, given by its _target_, was"
UNREGISTERED = "robot._target_: must be a registered component, was"


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("robot", {"_target_": "os.system", "command": "true"}, f"{UNREGISTERED} 'os"),
        ("robot", {"_target_": "armz"}, f"{UNREGISTERED} 'armz'; did you mean 'arms'?"),
        *(("robot", value, f"robot: {UNNAMED} {value}") for value in ({}, None, [1])),
        ("seed", "0", "seed: must be a whole number, at least 0, was '0'"),
        *(
            ("seed", v, f"seed: must be a whole number, at least 0, was {v}")
            for v in (True, -1, None)
        ),
        ("sead", 1, "sead: unknown setting; did you mean 'seed'?"),
    ],
)
def test_parts_that_cannot_be(config: dict[str, Any], part: str, value: Any, message: str) -> None:
    assert message in refusal(config | {part: value})


def test_components_in_the_wrong_place_are_refused(config: dict[str, Any]) -> None:
    robot, scenario, planner = config["robot"], config["scenario"], config["planner"]
    search = {"_target_": "random_search", "revision": 1}
    taken = "(ArmMotion or LinkMotion or MoveitTask or GridMotion)"
    for changes, message in (
        ({"robot": scenario}, "robot: must be one that via_point_ga takes (Robot), was"),
        ({"scenario": robot}, f"scenario: must be one that via_point_ga takes {taken}, was 'arms'"),
        ({"planner": robot}, "planner: must be a planner, was 'arms'"),
        ({"planner": search | {"planner": 3}}, "planner: must be a planner, was 3"),
        (
            {"planner": search | {"planner": planner}, "scenario": robot},
            "scenario: must be one that via_point_ga",
        ),
        ({"planner": planner | {"ga": robot}}, "planner.ga: must be a GeneticSettings"),
    ):
        assert refusal(config | changes).startswith(message)


@pytest.mark.parametrize("value", [{}, [], None, 3])
def test_a_component_without_a_name_is_refused(config: dict[str, Any], value: Any) -> None:
    arms = [*config["robot"]["arms"][:-1], value]
    changed = config | {"robot": config["robot"] | {"arms": arms}}
    assert refusal(changed).startswith(f"robot.arms[{len(arms) - 1}]: {UNNAMED}")
    changed = config | {"planner": config["planner"] | {"ga": value}}
    assert refusal(changed).startswith("planner.ga")  # or the first setting that is missing


def test_a_refusal_is_a_line_that_can_be_read(config: dict[str, Any]) -> None:
    arms = [{"_target_": "planar_chain", "revision": 9}] * 5000
    assert len(refusal(config | {"robot": config["robot"] | {"arms": arms}})) < 1300
    assert len(refusal(config | {"robot": {"_target_": "x" * 5000}})) < 1500


TEXTS = {
    "cut": b"{",
    "list": b"[]",
    "no text": b"\xff\xfe",
    "deep list": b"[" * 100_000,
    "deep mapping": b'{"robot": ' * 100_000,
}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_a_text_that_is_no_condition_is_refused(text: bytes) -> None:
    assert "config.json: must be a condition in JSON" in refusal(text)


def test_another_revision_or_setting_is_refused_by_name(config: dict[str, Any]) -> None:
    for name, value, kind, message in (
        ("revision", 7, RevisionMismatch, "planner.ga was revision 7, installed is 1"),
        ("population_sise", 3, UnknownSetting, "unknown setting; did you mean 'population_si"),
    ):
        changed = with_value(config, ("planner", "ga", name), value)
        with pytest.raises(kind, match=message):
            Condition.from_json(json.dumps(changed).encode())


def test_revisions_are_listed_for_every_component(shipped: Condition) -> None:
    rows = revisions(json.loads(shipped.to_json()))
    arms = {"robot.arms[0]"} if hasattr(shipped.robot, "arms") else set()
    assert {"robot", "scenario", "planner"} | arms <= {field for field, _, _ in rows}
    assert all(stored == installed for _, stored, installed in rows)


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


def test_every_component_is_registered_and_nothing_else() -> None:
    for path in (path for path in SOURCE.rglob("*/*.py") if "assets" not in path.parts):
        importlib.import_module(".".join(path.relative_to(SOURCE.parent).with_suffix("").parts))
    kinds: list[type] = [Component]
    for kind in kinds:
        kinds += kind.__subclasses__()
    named = {
        kind.component: f"{kind.__module__}:{kind.__name__}"
        for kind in kinds
        if "component" in vars(kind) and kind.__module__.startswith("evoexp.")
    }
    registered = {
        each.name: each.target
        for each in registry.registrations(registry.COMPONENTS)
        if each.is_own
    }
    assert registered == named


@pytest.mark.parametrize("group", [registry.COMPONENTS, registry.PAGES, registry.CLAIMS])
def test_the_module_of_a_registration_holds_what_it_names(group: str) -> None:
    own = [each for each in registry.registrations(group) if each.is_own]
    assert own
    for each in own if group != registry.COMPONENTS else own[:4]:
        assert each.package.startswith("evoexp ")
        if each.file is not None:
            assert each.file.is_file()
        elif hasattr(loaded := each.load(), "__module__"):
            assert each.module == loaded.__module__
        assert each.module.startswith("evoexp.")


@pytest.fixture
def guest(tmp_path: Path) -> Iterator[Callable[..., None]]:
    """Return what registers names of a guest's module, which is on the path."""
    (tmp_path / "guest_module.py").write_text(
        "from evoexp.evolution.operators.operator import GeneticSettings\n"
        "class Mine(GeneticSettings):\n    component = 'my_plug_in'\n"
    )

    def register(package: str, *names: str, target: str = "guest_module:Mine", **more: str) -> None:
        write_distribution(tmp_path, package, components=dict.fromkeys(names, target), **more)
        registry.clear()

    with on_path(tmp_path):
        yield register


Register = Callable[..., None]


def test_an_installed_package_registers_components(guest: Register, config: dict[str, Any]) -> None:
    guest("My.plug-in", "my_plug_in", "my_plug_in_too")
    config["planner"]["ga"]["_target_"] = "my_plug_in"
    mine = Condition.from_config(config)
    kind: Any = type(mine.planner.ga)  # type: ignore[attr-defined]
    assert kind.__name__ == "Mine" and component_class("my_plug_in_too") is kind
    assert registry.guests(mine.to_json()) == {"my_plug_in": "My.plug-in 1.0"}


@pytest.mark.parametrize(
    ("name", "target", "message"),
    [
        ("mine", "guest_module:Mine", "must register names that begin with its own, 'plug_in' or"),
        ("plug_inn", "guest_module:Mine", "must register names that begin with its own"),
        ("plug_in_lost", "guest_module:Lost", "registers guest_module:Lost, which cannot be"),
        ("plug_in_gone", "no_such_module:A", "registers no_such_module:A, which cannot be"),
    ],
)
def test_a_package_that_registers_wrongly_is_named(
    guest: Register, name: str, target: str, message: str
) -> None:
    guest("plug-in", name, target=target)
    with pytest.raises(RegistrationError) as caught:
        component_class(name)
    assert str(caught.value).startswith(f"{name}: plug-in 1.0 {message}")
    assert component_class("arms").component == "arms"  # other names are as good as before


def test_two_packages_of_one_name_are_both_named(guest: Register) -> None:
    guest("plug", "plug_in", version="2.0")
    guest("plug-in", "plug_in", "genetic")
    for name, both in (
        ("plug_in", "plug 2.0 and plug-in 1.0"),
        ("genetic", f"evoexp {__version__} and plug-in 1.0; uninstall"),
    ):
        with pytest.raises(RegistrationError, match=f"{name}: registered by {both}"):
            component_class(name)


def test_without_its_metadata_evoexp_says_that_it_is_not_installed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(importlib.metadata, "distributions", lambda: iter(()))
    registry.clear()
    with pytest.raises(RegistrationError, match="evoexp: is not installed"):
        component_class("arms")
    registry.clear()
