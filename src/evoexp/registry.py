"""The registry: the names that a configuration may use for components.

A configuration is data; it can name registered components only, also when it comes out of somebody
else's log.
"""

import functools
import importlib
import importlib.metadata
from collections.abc import Iterator
from typing import Any, cast

from evoexp.errors import SettingError, nearest
from evoexp.validation import TARGET, Component

REGISTRY = {
    "arms": "evoexp.robots.arms:Arms",
    "mobile_arm": "evoexp.robots.mobile_arm:MobileArm",
    "planar_chain": "evoexp.robots.planar_chain:PlanarChain",
    "serial_chain": "evoexp.robots.serial_chain:SerialChain",
    "urdf": "evoexp.robots.urdf:Urdf",
    "dh_chain": "evoexp.robots.dh_chain:DhChain",
    "floor_platform": "evoexp.robots.floor_platform:FloorPlatform",
    "floor_manipulator": "evoexp.robots.floor_manipulator:FloorManipulator",
    "mission": "evoexp.scenarios.mission:Mission",
    "grid_motion": "evoexp.scenarios.grid_motion:GridMotion",
    "link_motion": "evoexp.scenarios.link_motion:LinkMotion",
    "pick_and_place": "evoexp.scenarios.pick_and_place:PickAndPlace",
    "docking": "evoexp.scenarios.docking:Docking",
    "arm_motion": "evoexp.scenarios.arm_motion:ArmMotion",
    "posture_task": "evoexp.scenarios.posture_task:PostureTask",
    "via_point_ga": "evoexp.planners.via_point_ga.planner:ViaPointGa",
    "coevolution": "evoexp.planners.coevolution.planner:Coevolution",
    "redundant_ga": "evoexp.planners.redundant_ga.planner:RedundantGa",
    "posture_es": "evoexp.planners.posture_es.planner:PostureEs",
    "two_stage": "evoexp.planners.two_stage.planner:TwoStage",
    "grid_path_ga": "evoexp.planners.grid_path_ga.planner:GridPathGa",
    "grid_frontier": "evoexp.references.grid_frontier:GridFrontier",
    "placement_ga": "evoexp.planners.placement_ga.planner:PlacementGa",
    "random_search": "evoexp.planners.baselines.random_search:RandomSearch",
    "placement_optimum": "evoexp.references.placement_optimum:PlacementOptimum",
    "placement_conventional": "evoexp.references.placement_conventional:PlacementConventional",
    "placement_landscape": "evoexp.references.placement_landscape:PlacementLandscape",
    "genetic": "evoexp.evolution.genetic_settings:GeneticSettings",
    "coevolutionary": "evoexp.planners.coevolution.settings:CoevolutionSettings",
    "real_genetic": "evoexp.planners.redundant_ga.settings:RealGenetic",
    "binary_genetic": "evoexp.planners.redundant_ga.settings:BinaryGenetic",
    "strategy": "evoexp.planners.posture_es.settings:StrategySettings",
    "scaled_genetic": "evoexp.evolution.scaled_settings:ScaledGenetic",
    "motion_criteria": "evoexp.objectives.motion_criteria:MotionCriteria",
    "path_cost": "evoexp.objectives.path_cost:PathCost",
    "potential_fields": "evoexp.collision.models.potential_fields:PotentialFields",
    "string_fitness": "evoexp.objectives.string_fitness:StringFitness",
    "placement_criteria": "evoexp.objectives.placement_criteria:PlacementCriteria",
    "reaching": "evoexp.objectives.reaching:Reaching",
    "posture_cost": "evoexp.objectives.posture_cost:PostureCost",
    "link_ellipses": "evoexp.collision.models.link_ellipses:LinkEllipses",
    "link_crossings": "evoexp.collision.models.link_collision:LinkCrossings",
    "sphere_sets": "evoexp.collision.models.body_models:SphereSets",
    "body_capsules": "evoexp.collision.models.body_models:BodyCapsules",
    "touching_spheres": "evoexp.collision.models.touching_spheres:TouchingSpheres",
}
"""Registered name → `module:class`.

Installed plug-ins add to it through the entry-point group `evoexp.components`.
"""


def component_class(name: str, field: str = TARGET) -> type[Component]:
    """Return the class registered under a name.

    Raises:
        SettingError: If the name is not registered; a configuration cannot name other code.
    """
    path = _registry().get(name)
    if path is None:
        must = "a registered component"
        raise SettingError(f"{field}.{TARGET}", must, name, nearest(name, _registry()))
    module, _, attribute = path.partition(":")
    return cast(type[Component], getattr(importlib.import_module(module), attribute))


@functools.cache
def _registry() -> dict[str, str]:
    plugins = {
        point.name: point.value
        for point in importlib.metadata.entry_points(group="evoexp.components")
    }
    return plugins | REGISTRY


def component_modules(config: Any) -> Iterator[str]:
    """Yield the modules of all components that plain configuration data names."""
    if isinstance(config, dict):
        path = _registry().get(str(config.get(TARGET)))
        if path is not None:
            yield path.partition(":")[0]
        for value in config.values():
            yield from component_modules(value)
    elif isinstance(config, list):
        for value in config:
            yield from component_modules(value)
