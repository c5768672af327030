"""From overrides to conditions: identities, labels, budgets, and the names of reports."""

import functools
from collections.abc import Callable
from pathlib import Path

import hydra
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from omegaconf import OmegaConf

from evoexp import shipped
from evoexp.configuration import compose
from evoexp.configuration.compose import expand
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.overrides import assigned, collect
from evoexp.configuration.search_path import find
from evoexp.errors import SettingError
from shipped_conditions import expanded

PLAIN = ("experiment=rana_obstacles",)  # one condition


def ids(*overrides: str, multirun: bool = False, only: tuple[str, ...] = ()) -> dict[str, str]:
    """Return label → hash of everything that some overrides expand to."""
    experiments = expand(overrides, multirun=multirun, only=only)
    return {label: condition.id for e in experiments for label, condition in e.conditions}


@functools.cache
def one(*overrides: str) -> str:
    """Return the hash of the first condition."""
    return next(iter(ids(*overrides).values()))


@pytest.fixture
def write_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a function that writes an experiment file into a folder that is searched first."""
    monkeypatch.setenv("EVOEXP_CONFIG_DIR", str(tmp_path))
    (tmp_path / "experiment").mkdir()
    head = Path(find("experiment", "rana_obstacles").path).read_text()

    def write(name: str, conditions: str, extra: str = "") -> None:
        (tmp_path / f"experiment/{name}.yaml").write_text(
            f"{head.replace('rana_obstacles', 'rana_planar')}\n{extra}\nconditions:\n{conditions}\n"
        )

    return write


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "words",
    [
        ("experiment=rana_planar", "control=random_search", "seed=3"),
        ("experiment=rana_planar", "ga.population_size=9", "robot.arms.1.base_position=[0,9]"),
        ("experiment=lavoie", "++ga.population_size=9", "+scenario.new={a: [1, {b: 'c, d'}]}"),
        ("experiment=lavoie", "~ga.population_size", "budget=smoke", "report.formats=[pdf,svg]"),
    ],
)
def test_settings_are_as_hydra_itself_sets_them(words: tuple[str, ...]) -> None:
    with hydra.initialize_config_dir(str(shipped.config_directory()), version_base="1.3"):
        by_hydra = OmegaConf.to_container(hydra.compose("config", overrides=[*words]))
    chosen = collect(map(compose.parse, words))
    experiment = find("experiment", chosen.pop("experiment").typed)
    options = compose.Composer(experiment).chosen(chosen)
    assert assigned(options.config, chosen) == by_hydra


def test_an_option_may_choose_another_by_the_name_of_a_third(
    write_experiment: Callable[..., None], tmp_path: Path
) -> None:
    chosen = "defaults: [rana_planar, {by@_here_: '${collision}'}]\n"
    for file, text in (
        ("collision/mine", "defaults: [rana_planar]\n"),
        ("objective/mine", chosen),
        ("objective/by/mine", "collision_weight: 3\n"),
        ("objective/by/rana_planar", "collision_weight: 2\n"),
    ):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / f"{file}.yaml").write_text(text)
    choices = ("", "objective=mine", "collision=mine", "objective=mine, collision=mine")
    write_experiment("mine", "\n".join(f"  {k}: [{words}]" for k, words in enumerate(choices)))
    assert len(set(ids("experiment=mine").values())) == 3


# Identity


@pytest.mark.parametrize(
    "override",
    [
        *("num_replicates=3", "runner.num_workers=7", "runner=serial", "report.dpi=10"),
        *("report=paper", "budget=quick", "scenario.security_margin=1", "ga.population_size=50"),
        *("ga.mutation_rate=1", "++ga.population_size=50", "ga=rana_planar"),
        *("robot.arms.1.base_position=[0,8]", "planner.redistribution=True"),
    ],
)
@pytest.mark.examples(2)
def test_what_changes_no_result_changes_no_hash(override: str) -> None:
    (experiment,) = expand([*PLAIN, override])
    assert experiment.conditions[0].condition.id == one(*PLAIN)
    assert not experiment.changed


def test_the_same_condition_under_another_experiment_and_label_has_the_same_hash() -> None:
    (plain, *_) = ids("experiment=rana_planar").values()
    assert ids("experiment=rana_obstacles", "scenario=rana_planar") == {"rana_obstacles": plain}
    groups = [f"{g}=rana_planar" for g in ("scenario", "planner", "ga", "objective", "collision")]
    (custom,) = expand(["robot=two_planar_2r", *groups])
    assert [(label, c.id) for label, c in custom.conditions] == [("custom", plain)]
    assert custom.changed and custom.report_name.startswith("custom+")


def test_one_hash_from_a_single_run_and_from_a_multirun() -> None:
    swept = ids(*PLAIN, "ga.population_size=20,30", "seed=0,1", multirun=True)
    assert swept == {
        f"population_size={size} · seed={k}": one(*PLAIN, f"ga.population_size={size}", f"seed={k}")
        for size in (20, 30)
        for k in (0, 1)
    }
    assert len(set(swept.values())) == 4


SETTINGS = (
    *(*PLAIN, "budget=smoke", "num_replicates=2", "seed=3", "ga.population_size=20"),
    *("scenario=rana_planar", "scenario.security_margin=2", "control=null"),
)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.permutations(SETTINGS))
def test_any_order_of_overrides_gives_one_hash(overrides: list[str]) -> None:
    assert expand(overrides) == expand(SETTINGS)


# Labels


def test_labels_are_templates_over_sweeps(write_experiment: Callable[..., None]) -> None:
    write_experiment(
        "mine",
        """
  "λ = {}": ["ga.population_size=10,20"]
  "{} elites of {}": ["ga.num_elites=0,2", "ga.population_size=range(30,32)", seed=4]
  "at {rate}": [ga.crossover_rate=0.25]
  plain: ["ga.crossover_rate=0.5,0.75"]
  "0.5": []
""",
    )
    found = {}
    for label, condition in expand(["experiment=mine"])[0].conditions:
        ga = condition.planner.ga
        found[label] = (ga.num_elites, ga.population_size, ga.crossover_rate, condition.seed)
    assert found == {
        **{f"λ = {size}": (2, size, 0.9, 0) for size in (10, 20)},
        **{f"{k} elites of {size}": (k, size, 0.9, 4) for k in (0, 2) for size in (30, 31)},
        "at {rate}": (2, 50, 0.25, 0),
        **{f"plain · crossover_rate={rate}": (2, 50, rate, 0) for rate in (0.5, 0.75)},
        "0.5": (2, 50, 0.9, 0),
    }


def test_the_command_line_wins_over_an_entry_which_wins_over_the_file(
    write_experiment: Callable[..., None],
) -> None:
    write_experiment("mine", "  a: [ga.population_size=10]\n  b: []", "seed: 5")
    base = (*PLAIN, "scenario=rana_planar", "seed=5")
    assert ids("experiment=mine") == {"a": one(*base, "ga.population_size=10"), "b": one(*base)}
    swept = ids("experiment=mine", "ga.population_size=30,50", multirun=True)
    sizes = {size: one(*base, f"ga.population_size={size}") for size in (30, 50)}
    assert swept == {f"b · population_size={size}": each for size, each in sizes.items()}


def test_conditions_that_become_one_are_named_by_what_overrides_them() -> None:
    plain = ids("experiment=rana_planar")
    for word in ("control=null", "~control"):
        assert ids("experiment=rana_planar", word) == {word: plain["via-point GA"]}
    swept = ids("experiment=rana_planar", "control=null,random_search", multirun=True)
    names = {"control=null": "via-point GA", "control=random_search": "random search"}
    assert swept == {label: plain[name] for label, name in names.items()}


def test_a_condition_with_no_label_of_the_file_is_named_by_what_overrides_it(
    write_experiment: Callable[..., None],
) -> None:
    entries = ("0 elites: [ga.num_elites=0]", "2 elites: [ga.num_elites=2]")
    many = "many: [ga.num_elites=2, ga.population_size=90]"
    write_experiment("mine", "".join(f"  {entry}\n" for entry in (*entries, many)))
    for override, labels in {
        "ga.num_elites=5": ["num_elites=5", "many · num_elites=5"],
        "ga.num_elites=2": ["num_elites=2", "many · num_elites=2"],
        "ga.population_size=40": [f"{k} elites · population_size=40" for k in (0, 2)],
        "ga.mutation_rate=0.5": ["0 elites", "2 elites", "many"],
    }.items():
        assert list(ids("experiment=mine", override)) == labels


def test_labels_that_would_be_equal_are_whole(write_experiment: Callable[..., None]) -> None:
    entries = (f'"{name}, {k}": [ga={name}, seed={k}]' for name in ("a", "b") for k in (1, 2))
    both = ("rana_planar", "rana_puma")
    text = "".join(f"  {entry}\n" for entry in entries)
    write_experiment("mine", text.replace("ga=a", f"ga={both[0]}").replace("ga=b", f"ga={both[1]}"))
    assert list(ids("experiment=mine", "ga=rana_puma")) == [
        f"a, {k} · ga=rana_puma ≡ b, {k} · ga=rana_puma" for k in (1, 2)
    ]


def test_two_labels_of_one_condition_are_one_row(write_experiment: Callable[..., None]) -> None:
    write_experiment("mine", '  "as printed": []\n  "{} elites": ["ga.num_elites=0,2"]')
    found = ids("experiment=mine")
    assert list(found) == ["as printed ≡ 2 elites", "0 elites"]
    for label in (*["as printed", "2 elites"], "as printed ≡ 2 elites"):
        (picked,) = expand(["experiment=mine"], only=[label])
        assert [each.label for each in picked.conditions] == ["as printed ≡ 2 elites"]


def test_of_labels_that_a_budget_makes_one_the_first_stands() -> None:
    words = ("experiment=lavoie_stopping", "budget=smoke")
    first = [label for label in ids(words[0]) if "at most 300" not in label]
    capped = ids(*words)
    assert list(capped) == first and len(set(capped.values())) == len(capped)
    picked = ids(*words, only=("stop below 1.5", "at most 300"))
    assert list(picked) == ["stop below 1.5, at most 100"]
    swept = ids(*PLAIN, words[1], "ga.num_generations=100,200", multirun=True)
    assert list(swept) == ["num_generations=100 ≡ num_generations=200"]


def test_two_swept_settings_of_one_name_are_told_apart() -> None:
    lengths = [f"robot.arms.{arm}.link_lengths=[4,4],[3,3]" for arm in (0, 1)]
    swept = ids(*PLAIN, *lengths, multirun=True)
    label = "robot.arms.0.link_lengths=[4,4] · robot.arms.1.link_lengths=[3,3]"
    assert len(swept) == 4
    assert swept[label] == one(*PLAIN, "robot.arms.1.link_lengths=[3,3]")


def test_only_picks_labels() -> None:
    plain = ids("experiment=rana_planar")
    for labels in (("random search",), ("random search", "via-point GA")):
        picked = ids("experiment=rana_planar", only=labels)
        assert picked == {label: plain[label] for label in labels}
    (picked,) = expand(["experiment=rana_planar"], only=["random search"])
    assert picked.changed and picked.report_name.startswith("rana_planar+")
    assert not expand(["experiment=rana_planar"], only=list(plain))[0].changed
    # labels with commas, that the command line splits
    words = ("experiment=corsepius", "budget=smoke")
    picked = ids(*words, only=("pose", "empty scene", "wall", "pose"))
    assert list(picked) == ["pose", "pose, empty scene", "wall"]


def test_a_multirun_drops_no_experiment_and_no_condition() -> None:
    names = ["rana_planar", "rana_obstacles", "rana_three_arms"]
    words = [f"experiment={','.join(names)}", "budget=smoke", "seed=0,1"]
    experiments = expand(words, multirun=True)
    assert [e.name for e in experiments] == names
    assert [len(e.conditions) for e in experiments] == [6, 2, 2]
    assert len({c.id for e in experiments for _, c in e.conditions}) == 10
    chosen = expand(["experiment=choice(rana_planar,rana_obstacles)"], multirun=True)
    assert [e.name for e in chosen] == names[:2]


# Settings that some conditions have


def test_a_setting_concerns_the_conditions_that_have_it() -> None:
    words, override = ("experiment=rana_planar",), "control.num_sweeps=7"
    plain, changed = ids(*words), ids(*words, override)
    assert [label for label in plain if changed[label] != plain[label]] == ["multi-start"]
    picked = ids(*words, override, only=("multi-start",))
    assert picked == {"multi-start": changed["multi-start"]}
    swept = ids(*words, "control.num_sweeps=7,40", multirun=True)
    assert swept == {
        "via-point GA": plain["via-point GA"],
        "random search": plain["random search"],
        "multi-start · num_sweeps=7": changed["multi-start"],
        "multi-start · num_sweeps=40": plain["multi-start"],
    }


def test_a_part_concerns_the_conditions_whose_planner_takes_it(
    write_experiment: Callable[..., None], tmp_path: Path
) -> None:
    (tmp_path / "planner").mkdir()
    text = Path(find("planner", "rana_planar").path).read_text()
    own = "ga: {_target_: genetic, population_size: 9, num_generations: 5, num_elites: 1,"
    own += " crossover_rate: 0.5, mutation_rate: 1.0}"
    (tmp_path / "planner/with_ga.yaml").write_text(text.replace("ga: ${ga}", own))
    write_experiment("mine", '  "taken": []\n  "own": [planner=with_ga, ~ga]')
    plain, other = ids("experiment=mine"), ids("experiment=mine", "ga=rana_puma")
    assert list(other) == ["taken · ga=rana_puma", "own"]
    assert other["own"] == plain["own"] and other["taken · ga=rana_puma"] != plain["taken"]


def test_a_file_that_an_override_replaces_need_not_be_there(tmp_path: Path) -> None:
    arm = Path(__file__).parents[1] / "robots/data/ur5_like/ur5_like.urdf"
    chosen = {"robot": "urdf", "scenario": "urdf_reach", "planner": "posture_es", "ga": "corsepius"}
    chosen |= {"objective": "corsepius_reach", "collision": "corsepius_spheres"}
    overrides = "".join(f"  - override /{group}: {name}\n" for group, name in chosen.items())
    path = tmp_path / "mine.yaml"
    path.write_text(
        f"# @package _global_\ndefaults:\n{overrides}robot: {{path: not/there.urdf}}\n"
        "conditions: {one: [seed=1], other: []}\n"
    )
    words = (f"experiment={path}", f"robot.path={arm}")
    for only in ((), ("one",)):
        (found,) = expand(words, only=only)
        assert found.changed and found.conditions[0].label == "one"
    with pytest.raises(SettingError, match=r"robot.path: must be a file that can be read"):
        expand(words[:1])


# Budgets


def test_the_budget_of_a_condition_is_what_capped_it() -> None:
    for words, budget in (
        (("budget=quick",), "paper"),
        (("budget=smoke",), "smoke"),
        (("budget=smoke", "ga.num_generations=10"), "paper"),
        (("budget.collision_queries=1e5",), "paper, capped"),
    ):
        assert expand([*PLAIN, *words])[0].budget_of("rana_obstacles") == budget


def generations(experiment: Experiment) -> set[int]:
    planners = [getattr(c.planner, "planner", c.planner) for _, c in experiment.conditions]
    return {planner.ga.num_generations for planner in planners}


def test_budgets_cap_and_quick_keeps_the_hashes() -> None:
    paper, quick, smoke = (expanded("rana_planar", each) for each in ("paper", "quick", "smoke"))
    assert (paper.num_replicates, quick.num_replicates, smoke.num_replicates) == (200, 5, 2)
    assert quick.conditions == paper.conditions
    assert (generations(paper), generations(smoke)) == ({500}, {10})
    assert not {c.id for _, c in smoke.conditions} & {c.id for _, c in paper.conditions}


@pytest.mark.parametrize(("asked", "effective"), [(3, 3), (10, 10), (11, 10), (500, 10)])
def test_a_budget_caps_and_never_raises(asked: int, effective: int) -> None:
    words = ("experiment=rana_planar", "budget=smoke", f"ga.num_generations={asked}")
    (experiment,) = expand(words)
    assert generations(experiment) == {effective}
    assert experiment.changed is (effective != 10)
    assert one(*words) == one("experiment=rana_planar", f"ga.num_generations={effective}")
    for budget, count, expected in (("smoke", 1, 1), ("smoke", 50, 2), ("paper", 50, 50)):
        (capped,) = expand([*PLAIN, f"budget={budget}", f"num_replicates={count}"])
        assert capped.num_replicates == expected


def test_a_report_has_a_name_of_its_own_only_where_its_conditions_differ() -> None:
    def name(*words: str, multirun: bool = False) -> str:
        words = ("experiment=rana_planar", "budget=smoke", *words)
        return expand(words, multirun=multirun)[0].report_name

    plain = "rana_planar@smoke"
    same = ("ga.population_size=50", "seed=0", "num_replicates=1", "report.dpi=20")
    assert name(*same, "ga.num_generations=400") == plain
    changes = ("ga.population_size=49", "ga.population_size=48", "seed=1")
    names = {*map(name, (*changes, "budget.max_generations=4")), name("seed=0,1", multirun=True)}
    assert len(names) == 5
    assert all(each.startswith(f"{plain}+") and len(each) == len(plain) + 9 for each in names)


# What a planner takes from other groups


def test_a_group_that_the_planner_does_not_take_is_refused(
    write_experiment: Callable[..., None], tmp_path: Path
) -> None:
    write_experiment("mine", "  a: []")
    text = Path(find("planner", "rana_planar").path).read_text()
    (tmp_path / "planner").mkdir()
    (tmp_path / "planner/rana_planar.yaml").write_text(text.replace("ga: ${ga}\n", ""))
    with pytest.raises(SettingError, match="ga: must be a part of the chosen planner, was"):
        expand(["experiment=mine"])
    with pytest.raises(SettingError, match=r"planner.ga: must be given, was None"):
        expand(["experiment=mine", "ga=null"])
