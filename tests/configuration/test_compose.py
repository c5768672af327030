"""From overrides to conditions.

Identities, labels, budgets, and what makes a report another one.
"""

import functools
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import hydra
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from omegaconf import OmegaConf

from evoexp import shipped
from evoexp.configuration import compose
from evoexp.configuration.assignment import assigned
from evoexp.configuration.compose import expand
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.overrides import collect
from evoexp.configuration.search_path import description, find, options
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting
from matrix import examples
from shipped_conditions import EXAMPLES, expanded

PLAIN = ("experiment=rana_obstacles",)  # one condition
BUDGETS = ("paper", "quick", "smoke")
EXPERIMENTS = examples(options("experiment"), lambda name: name in dict(EXAMPLES))


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


@pytest.mark.examples(4)
@pytest.mark.parametrize("experiment", EXPERIMENTS)
@pytest.mark.parametrize("budget", ["paper", "smoke"])
def test_every_experiment_composes_at_every_budget(experiment: str, budget: str) -> None:
    found = expanded(experiment, budget)
    assert (found.name, found.budget, found.changed) == (experiment, budget, False)
    assert found.report_name == (experiment if budget == "paper" else f"{experiment}@{budget}")
    assert len({label for label, _ in found.conditions}) == len(found.conditions) > 0
    for _, condition in found.conditions:
        assert len(condition.id) == 64


@pytest.mark.examples(2)
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_quick_budget_has_the_conditions_of_the_papers(experiment: str) -> None:
    paper = expanded(experiment, "paper")
    label, condition = paper.conditions[0]
    (quick,) = expand([f"experiment={experiment}", "budget=quick"], only=[label])
    assert (quick.name, quick.budget) == (experiment, "quick")
    assert [(each.label, each.condition.id) for each in quick.conditions] == [(label, condition.id)]
    assert quick.num_replicates == min(paper.num_replicates, 5)


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
    with TemporaryDirectory() as root:
        options = compose.Composer(Path(root), experiment).chosen(chosen)
    assert assigned(options.config, chosen) == by_hydra


def test_an_option_may_choose_another_by_the_name_of_a_third(
    write_experiment: Callable[..., None], tmp_path: Path
) -> None:
    for group in ("collision", "objective/by"):
        (tmp_path / group).mkdir(parents=True)
    (tmp_path / "collision/mine.yaml").write_text("defaults: [rana_planar]\n")
    (tmp_path / "objective/mine.yaml").write_text(
        "defaults: [rana_planar, {by@_here_: '${collision}'}]\n"
    )
    for name, weight in (("mine", 3), ("rana_planar", 2)):
        (tmp_path / f"objective/by/{name}.yaml").write_text(f"collision_weight: {weight}\n")
    write_experiment(
        "mine",
        "  A: []\n  B: [objective=mine]\n  C: [collision=mine]\n"
        "  D: [objective=mine, collision=mine]",
    )
    assert len(set(ids("experiment=mine").values())) == 3


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_file_says_how_it_is_run_and_what_it_is(experiment: str) -> None:
    lines = Path(find("experiment", experiment).path).read_text().splitlines()
    assert lines[1] == f"# evoexp run experiment={experiment}"
    assert description(experiment) == lines[2].removeprefix("# ") != ""


# Identity


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "overrides",
    [
        ("num_replicates=3",),
        ("runner.num_workers=7",),
        ("runner=serial",),
        ("report.dpi=10", "report=paper"),
        ("budget=quick",),
        ("scenario.security_margin=1",),
        ("ga.population_size=50",),
        ("ga.mutation_rate=1",),
        ("++ga.population_size=50",),
        ("ga=rana_planar",),
        ("robot.arms.1.base_position=[0,8]",),
        ("planner.redistribution=True",),
    ],
)
def test_what_changes_no_result_changes_no_hash(overrides: tuple[str, ...]) -> None:
    (experiment,) = expand([*PLAIN, *overrides])
    assert experiment.conditions[0].condition.id == one(*PLAIN)
    assert not experiment.changed


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "override",
    [
        "seed=1",
        "ga.population_size=51",
        "planner.redistribution=false",
        "robot.arms.0.link_lengths=[4,3.5]",
        "scenario.q_goal=[[135,135],[315,316]]",
        "scenario.obstacles=[]",
        "control=random_search",
        "budget=smoke",
    ],
)
def test_what_changes_results_changes_the_hash(override: str) -> None:
    """One of each kind; `test_condition` changes every setting there is."""
    (changed,) = expand([*PLAIN, override])
    assert changed.conditions[0].condition.id != one(*PLAIN)
    assert changed.changed is (override != "budget=smoke")
    assert ("+" in changed.report_name) is changed.changed


def test_the_same_condition_under_another_experiment_and_label_has_the_same_hash() -> None:
    planar = ids("experiment=rana_planar")
    assert ids("experiment=rana_obstacles", "scenario=rana_planar") == {
        "rana_obstacles": planar["via-point GA"]
    }
    groups = [f"{g}=rana_planar" for g in ("scenario", "planner", "ga", "objective", "collision")]
    assert ids("robot=two_planar_2r", *groups) == {"custom": planar["via-point GA"]}


def test_one_hash_from_a_single_run_and_from_a_multirun() -> None:
    swept = ids(*PLAIN, "ga.population_size=20,30", "seed=0,1", multirun=True)
    assert swept == {
        f"population_size={size} · seed={seed}": one(
            *PLAIN, f"ga.population_size={size}", f"seed={seed}"
        )
        for size in (20, 30)
        for seed in (0, 1)
    }
    assert len(set(swept.values())) == 4


SETTINGS = (
    "seed=3",
    "ga.population_size=20",
    "scenario=rana_planar",
    "scenario.security_margin=2",
    "control=null",
)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.permutations([*PLAIN, "budget=smoke", "num_replicates=2", *SETTINGS]))
def test_any_order_of_overrides_gives_one_hash(overrides: list[str]) -> None:
    (experiment,) = expand(overrides)
    (reference,) = expand([*PLAIN, "budget=smoke", "num_replicates=2", *SETTINGS])
    assert experiment == reference


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
    (experiment,) = expand(["experiment=mine"])
    found = {
        label: (
            c.planner.ga.num_elites,
            c.planner.ga.population_size,
            c.planner.ga.crossover_rate,
            c.seed,
        )
        for label, c in experiment.conditions
    }
    assert found == {
        "λ = 10": (2, 10, 0.9, 0),
        "λ = 20": (2, 20, 0.9, 0),
        "0 elites of 30": (0, 30, 0.9, 4),
        "0 elites of 31": (0, 31, 0.9, 4),
        "2 elites of 30": (2, 30, 0.9, 4),
        "2 elites of 31": (2, 31, 0.9, 4),
        "at {rate}": (2, 50, 0.25, 0),
        "plain · crossover_rate=0.5": (2, 50, 0.5, 0),
        "plain · crossover_rate=0.75": (2, 50, 0.75, 0),
        "0.5": (2, 50, 0.9, 0),
    }


def test_the_command_line_wins_over_an_entry_which_wins_over_the_file(
    write_experiment: Callable[..., None],
) -> None:
    write_experiment("mine", "  a: [ga.population_size=10]\n  b: []", "seed: 5")
    base = (*PLAIN, "scenario=rana_planar", "seed=5")
    assert ids("experiment=mine") == {"a": one(*base, "ga.population_size=10"), "b": one(*base)}
    both = one(*base, "ga.population_size=30")
    assert ids("experiment=mine", "ga.population_size=30") == {"b · population_size=30": both}
    swept = ids("experiment=mine", "ga.population_size=30,50", multirun=True)
    assert swept == {"b · population_size=30": both, "b · population_size=50": one(*base)}


def test_conditions_that_become_one_have_the_label_that_is_true_of_it() -> None:
    plain = ids("experiment=rana_planar")
    ga, drawn = "via-point GA", "random search"
    for word in ("control=null", "~control"):
        assert ids("experiment=rana_planar", word) == {ga: plain[ga]}
    assert ids("experiment=rana_planar", "control=random_search") == {drawn: plain[drawn]}
    swept = ids("experiment=rana_planar", "control=null,random_search", multirun=True)
    assert swept == {ga: plain[ga], drawn: plain[drawn]}
    methods = ids("experiment=curkovic_methods")
    assert ids("experiment=curkovic_methods", "ga=curkovic_1") == {"I": methods["I"]}


def test_a_condition_with_no_label_of_the_file_is_named_by_its_planner() -> None:
    words = ("experiment=rana_planar", "control=cma_es")
    (label,) = every = ids(*words)
    assert label == "cma_es"
    swept = ids(words[0], "control=stomp,cma_es", multirun=True)
    assert list(swept) == ["stomp", "cma_es"]
    assert swept["cma_es"] == every["cma_es"]
    # also where one of the labels that became one is picked
    for picked in ("random search", "via-point GA", "cma_es"):
        assert ids(*words, only=(picked,)) == every


def test_a_condition_with_no_label_of_the_file_is_named_by_what_overrides_it(
    write_experiment: Callable[..., None],
) -> None:
    write_experiment(
        "mine",
        """
  "0 elites": [ga.num_elites=0]
  "2 elites": [ga.num_elites=2]
  "many": [ga.num_elites=2, ga.population_size=90]
""",
    )
    plain = ids("experiment=mine")
    assert list(ids("experiment=mine", "ga.num_elites=5")) == [
        "num_elites=5",
        "many · num_elites=5",
    ]
    assert ids("experiment=mine", "ga.num_elites=2") == {
        "2 elites": plain["2 elites"],
        "many": plain["many"],
    }
    assert list(ids("experiment=mine", "ga.population_size=40")) == [
        "0 elites · population_size=40",
        "2 elites · population_size=40",
    ]
    assert list(ids("experiment=mine", "ga.mutation_rate=0.5")) == list(plain)


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
    swept = ids(
        *PLAIN,
        "robot.arms.0.link_lengths=[4,4],[3,3]",
        "robot.arms.1.link_lengths=[4,4],[3,3]",
        multirun=True,
    )
    label = "robot.arms.0.link_lengths=[4,4] · robot.arms.1.link_lengths=[3,3]"
    assert len(swept) == 4
    assert swept[label] == one(*PLAIN, "robot.arms.1.link_lengths=[3,3]")


def test_only_picks_labels_with_commas_that_the_command_line_splits() -> None:
    words = ("experiment=corsepius", "budget=smoke")
    picked = ids(*words, only=("pose", "empty scene", "wall", "pose"))
    assert list(picked) == ["pose", "pose, empty scene", "wall"]


def test_only_picks_labels() -> None:
    plain = ids("experiment=rana_planar")
    assert ids("experiment=rana_planar", only=("random search",)) == {
        "random search": plain["random search"]
    }
    two = ("random search", "via-point GA")
    assert ids("experiment=rana_planar", only=two) == {label: plain[label] for label in two}
    (picked,) = expand(["experiment=rana_planar"], only=["random search"])
    assert picked.changed
    assert picked.report_name.startswith("rana_planar+")
    assert not expand(["experiment=rana_planar"], only=list(plain))[0].changed


def test_a_multirun_drops_no_experiment_and_no_condition() -> None:
    names = ("rana_planar", "rana_obstacles", "rana_three_arms")
    experiments = expand(
        [f"experiment={','.join(names)}", "budget=smoke", "seed=0,1"], multirun=True
    )
    assert [e.name for e in experiments] == list(names)
    assert [len(e.conditions) for e in experiments] == [6, 2, 2]
    assert len({c.id for e in experiments for _, c in e.conditions}) == 10
    assert (
        expand(["experiment=choice(rana_planar,rana_obstacles)"], multirun=True)[1].name
        == "rana_obstacles"
    )


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ["ga.population_size=20,20"],
            "ga.population_size: must be values that differ, was '20,20'",
        ),
        (
            ["budget=smoke,paper"],
            "budget: must be one value: a sweep is over what changes a condition",
        ),
        (["num_replicates=2,3"], "num_replicates: must be one value"),
        (["runner.num_workers=1,2"], "runner.num_workers: must be one value"),
        (
            ["ga.population_size=glob(*)"],
            "ga.population_size: must be values that can be enumerated: a,b,c or range(…)",
        ),
        (
            ["ga.crossover_rate=interval(0,1)"],
            "ga.crossover_rate: must be values that can be enumerated",
        ),
        (
            ["planner=rana_planar,rana_plan"],
            "planner: no option 'rana_plan'; did you mean 'rana_planar'?",
        ),
    ],
)
def test_sweeps_that_cannot_be(overrides: list[str], message: str) -> None:
    with pytest.raises(EvoexpError) as caught:
        expand([*PLAIN, *overrides], multirun=True)
    assert message in str(caught.value)


def test_an_experiment_twice_is_refused() -> None:
    with pytest.raises(SettingError, match="experiment: must be names that differ"):
        expand(["experiment=rana_planar,rana_planar"], multirun=True)


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ("  a: 3", "conditions.a: must be a list of overrides, was 3"),
        ("  a: [3]", "conditions.a: must be a list of overrides, was [3]"),
        (
            '  "{} and {}": ["seed=1,2"]',
            "conditions.{} and {}: must be a label with one {} per swept override",
        ),
        ('  "λ={}": ["seed=1"]', "conditions.λ={}: must be a label with one {} per swept override"),
        (
            "  a: [num_replicates=3]",
            "conditions.a: must be free of num_replicates, which belongs to the whole",
        ),
        ("  a: [budget=smoke]", "conditions.a: must be free of budget"),
        (
            "  a: [ga.population_sise=3]",
            "ga.population_sise: unknown setting; did you mean 'population_size'?",
        ),
        ("  a: [ga=other]", "ga: no option 'other' (options: "),
        ("  a: [hydra.run.dir=x]", "nothing of Hydra's own"),
        (
            '  a: ["seed=1,2"]\n  "a · seed=1": []',
            "conditions: must be labels that differ, was 'a · seed=1'",
        ),
        ("  a: [ga.population_size=0]", "ga.population_size: must be at least 1, was 0"),
    ],
)
def test_entries_that_cannot_be(
    write_experiment: Callable[..., None], conditions: str, message: str
) -> None:
    write_experiment("mine", conditions)
    with pytest.raises(EvoexpError) as caught:
        expand(["experiment=mine"])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


# Settings that some conditions have


def test_a_setting_concerns_the_conditions_that_have_it() -> None:
    plain = ids("experiment=rana_planar")
    changed = ids("experiment=rana_planar", "control.num_sweeps=7")
    assert {label: changed[label] == each for label, each in plain.items()} == {
        "via-point GA": True,
        "random search": True,
        "multi-start": False,
    }
    assert ids("experiment=rana_planar", "control.num_sweeps=7", only=("multi-start",)) == {
        "multi-start": changed["multi-start"]
    }
    swept = ids("experiment=rana_planar", "control.num_sweeps=7,40", multirun=True)
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


@pytest.mark.parametrize(
    ("overrides", "only", "message"),
    [
        (["control.num_sweps=7"], (), "control.num_sweps: unknown setting; did you mean 'num_sw"),
        (["control.num_sweeps=seven"], (), "control.num_sweeps: must be a whole number, was 'seve"),
        (["reference.num_steps=100"], (), "reference: must be chosen: grid_frontier, "),
        (["control.num_sweeps=7"], ("random search",), "control.num_sweeps: unknown setting"),
        (["control.num_sweeps=7"], ("via-point GA",), "control: must be chosen: cma_es, "),
    ],
)
def test_a_setting_that_concerns_no_condition_is_refused(
    overrides: list[str], only: tuple[str, ...], message: str
) -> None:
    with pytest.raises(EvoexpError) as caught:
        expand(["experiment=rana_planar", *overrides], only=only)
    assert message in str(caught.value) and "\n" not in str(caught.value)


ARM = """<robot name="arm"><link name="base"/><link name="tip"><collision><geometry>
<box size="0.4 0.05 0.05"/></geometry></collision></link><joint name="turn" type="revolute">
<parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint></robot>"""


def test_a_file_that_an_override_replaces_need_not_be_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    groups = ("planner", "ga", "objective")
    chosen = "".join(f"  - override /{group}: via_points\n" for group in groups)
    (tmp_path / "arm.urdf").write_text(ARM)
    path = tmp_path / "mine.yaml"
    path.write_text(
        "# @package _global_\ndefaults:\n  - override /robot: urdf\n"
        f"  - override /scenario: rana_planar\n{chosen}  - override /collision: covered_bodies\n"
        "robot: {path: not/there.urdf}\n"
        "scenario: {_target_: arm_motion, q_start: [[-50.0]], q_goal: [[50.0]], length_unit: m,"
        " security_margin: 0.0}\nconditions: {few: [ga.population_size=10], many: []}\n"
    )
    words = (f"experiment={path}", f"robot.path={tmp_path / 'arm.urdf'}")
    for only in ((), ("few",)):
        (found,) = expand(words, only=only)
        assert found.changed
        assert found.conditions[0].label == "few"
    with pytest.raises(SettingError, match=r"robot.path: must be a file that can be read"):
        expand(words[:1])


# Budgets


def test_the_budget_of_a_condition_is_what_capped_it() -> None:
    budgets = [
        expand([*PLAIN, *words])[0].budget_of("rana_obstacles")
        for words in (
            ["budget=quick"],
            ["budget=smoke"],
            ["budget=smoke", "ga.num_generations=10"],
            ["budget.collision_queries=1e5"],
        )
    ]
    assert budgets == ["paper", "smoke", "paper", "paper, capped"]


def generations(experiment: Experiment) -> list[int]:
    return [
        getattr(c.planner, "planner", c.planner).ga.num_generations
        for _, c in experiment.conditions
    ]


def test_budgets_cap_and_quick_keeps_the_hashes() -> None:
    paper, quick, smoke = (
        expand(["experiment=rana_planar", f"budget={budget}"])[0] for budget in BUDGETS
    )
    assert (paper.num_replicates, quick.num_replicates, smoke.num_replicates) == (20, 5, 2)
    assert quick.conditions == paper.conditions
    assert (generations(paper), generations(smoke)) == ([500] * 3, [10] * 3)
    assert not {c.id for _, c in smoke.conditions} & {c.id for _, c in paper.conditions}


@pytest.mark.parametrize(("asked", "effective"), [(3, 3), (10, 10), (11, 10), (500, 10)])
def test_a_budget_caps_and_never_raises(asked: int, effective: int) -> None:
    (experiment,) = expand(
        ["experiment=rana_planar", "budget=smoke", f"ga.num_generations={asked}"]
    )
    assert generations(experiment) == [effective] * 3
    assert experiment.changed is (effective != 10)
    assert one("experiment=rana_planar", "budget=smoke", f"ga.num_generations={asked}") == one(
        "experiment=rana_planar", f"ga.num_generations={effective}"
    )


def test_a_budget_caps_replicates_and_never_raises_them() -> None:
    assert expand([*PLAIN, "budget=smoke", "num_replicates=1"])[0].num_replicates == 1
    assert expand([*PLAIN, "budget=smoke", "num_replicates=50"])[0].num_replicates == 2
    assert expand([*PLAIN, "num_replicates=50"])[0].num_replicates == 50


def test_a_changed_cap_is_another_report() -> None:
    (experiment,) = expand([*PLAIN, "budget=smoke", "budget.max_generations=4"])
    assert generations(experiment) == [4]
    assert experiment.report_name.startswith("rana_obstacles@smoke+")
    assert expand([*PLAIN, "budget=smoke", "budget.max_generations=4", "num_replicates=1"])[
        0
    ] == experiment._replace(num_replicates=1)


# Report names


def test_a_report_has_a_name_of_its_own_only_where_its_conditions_differ() -> None:
    plain = "rana_planar@smoke"
    same = [
        "ga.population_size=50",
        "seed=0",
        "num_replicates=1",
        "report.dpi=20",
        "ga.num_generations=400",
    ]
    assert expand(["experiment=rana_planar", "budget=smoke", *same])[0].report_name == plain
    names = [
        expand(["experiment=rana_planar", "budget=smoke", override])[0].report_name
        for override in ("ga.population_size=49", "ga.population_size=48", "seed=1")
    ]
    assert len(set(names)) == 3
    assert all(name.startswith(f"{plain}+") and len(name) == len(plain) + 9 for name in names)
    swept = expand(["experiment=rana_planar", "budget=smoke", "seed=0,1"], multirun=True)[0]
    assert swept.report_name.startswith(f"{plain}+")


def test_a_configuration_without_experiment_has_a_report_of_its_own() -> None:
    groups = [f"{g}=rana_planar" for g in ("scenario", "planner", "ga", "objective", "collision")]
    (experiment,) = expand(["robot=two_planar_2r", *groups])
    assert experiment.changed
    assert experiment.report_name.startswith("custom+")


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


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("overrides", "kind", "message"),
    [
        (
            ["planner.ga.population_size=20"],
            SettingError,
            "planner.ga.population_size: must be given as ga.population_",
        ),
        (["planner.ga=3"], SettingError, "planner.ga: must be left as it is; set ga"),
        (["ga=null"], SettingError, "ga: must be chosen: "),
        (["~objective"], SettingError, "objective: must be chosen: "),
        (["+control.x=1"], SettingError, "control: must be chosen: cma_es, multi_start, "),
        (
            ["control=random_search", "+control.planner=1"],
            SettingError,
            "control.planner: must be left out",
        ),
        (
            ["control=random_search", "planner.walk_step=0"],
            SettingError,
            "planner.walk_step: must be greater than 0",
        ),
        (
            ["control=random_search", "+control.x=1"],
            UnknownSetting,
            "control.x: unknown setting (known here: planner)",
        ),
        (
            ["control=multi_start", "control.num_sweeps=0"],
            SettingError,
            "control.num_sweeps: must be at least 1",
        ),
    ],
)
def test_parts_of_a_planner_are_set_in_their_own_group(
    overrides: list[str], kind: type[EvoexpError], message: str
) -> None:
    with pytest.raises(kind) as caught:
        expand([*PLAIN, *overrides])
    assert message in str(caught.value)


def test_unknown_labels_of_only_list_those_that_exist() -> None:
    with pytest.raises(
        UnknownOption,
        match=r"--only: no option 'random'.*\(options: multi-start, random search, via-point GA\)",
    ):
        expand(["experiment=rana_planar"], only=["random"])
