"""Building: a composed configuration, as plain data, checked and made into typed settings."""

from typing import Any

from evoexp.condition import PARTS, Condition, read_files
from evoexp.configuration.experiment import Budget
from evoexp.configuration.interpolations import fill_in
from evoexp.configuration.overrides import AROUND, PLANNER_PARTS
from evoexp.configuration.refusals import chosen
from evoexp.configuration.robots_of_tasks import (
    with_named_states,
    with_planning_group,
    with_shared_packages,
)
from evoexp.configuration.search_path import folders
from evoexp.errors import SettingError, UnknownSetting
from evoexp.registry import component_class
from evoexp.validation import TARGET, AnySettings, build, construct

MOST_REPLICATES = 1_000_000  # of one condition, each of which is a file


def condition_of(config: dict[str, Any], budget: Budget) -> tuple[Condition, bool]:
    """Build a composed configuration; return it with whether the budget capped it."""
    settings = {key: value for key, value in config.items() if key != "conditions"}
    plain, cap = fill_in(settings, settings), budget.max_generations
    asked = (plain.get("ga") or {}).get("num_generations")
    is_capped = cap is not None and isinstance(asked, int) and asked > cap
    if is_capped:  # before a planner takes it in
        settings["ga"] = settings["ga"] | {"num_generations": cap}
        plain = fill_in(settings, settings)
    built = build_condition(plain, str(config["planner"]))
    most = budget.collision_queries
    return built._replace(max_collision_queries=most), is_capped or most is not None


def build_condition(config: dict[str, Any], planner: str) -> Condition:
    """Build the condition of a configuration whose interpolations are filled in.

    The planner's settings as text, with interpolations, tell which groups the planner takes in.
    """
    beside = [folder.path / "scenario" for folder in folders()]  # where files lie
    read = read_files(with_shared_packages(config), beside, with_planning_group)
    plain = with_named_states(read)
    # groups that the planner takes in, whose errors name the group, as it was typed
    for group in (group for group in PLANNER_PARTS if plain.get(group) is not None):
        is_taken = f"${{{group}" in planner
        if group in plain["planner"] and not is_taken:
            must = f"left as it is; set {group}, the group that it is taken from"
            raise SettingError(f"planner.{group}", must, plain["planner"][group])
        if not is_taken:
            raise SettingError(group, "a part of the chosen planner", plain[group])
        build(plain[group], component_class, group)
    # a control or a reference is put around the planner
    around = [group for group in AROUND if plain.get(group) is not None]
    if len(around) > 1:
        must = f"left out beside a {around[0]}"
        raise SettingError(around[1], must, plain[around[1]].get(TARGET))
    for group in around:
        build(plain["planner"], component_class, "planner")
        if TARGET not in plain[group]:
            raise SettingError(group, chosen(group), plain[group])
        if "planner" in plain[group]:
            must = "left out: it is the chosen planner"
            raise SettingError(f"{group}.planner", must, plain[group]["planner"])
        plain["planner"] = {**plain[group], "planner": plain["planner"]}
        build(plain["planner"], component_class, group)  # its errors name the group, as typed
    return Condition.from_config({part: plain[part] for part in (*PARTS, "seed")})


def planned_replicates(count: Any, budget: Budget) -> int:
    """Return the number of replicates, capped by the budget."""
    if type(count) is not int or count < 1:
        raise SettingError("num_replicates", "a whole number, at least 1", count)
    if count > MOST_REPLICATES:
        raise SettingError("num_replicates", f"at most {MOST_REPLICATES}", count)
    return count if budget.max_replicates is None else min(count, budget.max_replicates)


def build_settings(kind: type[AnySettings], config: dict[str, Any], group: str) -> AnySettings:
    """Build the settings of a group that is no component."""
    if TARGET in config:
        raise UnknownSetting(f"{group}.{TARGET}", kind.model_fields)
    return construct(kind, build(config, component_class, group), group)
