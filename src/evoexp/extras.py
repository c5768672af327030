"""Components that need packages which evoexp itself does not, and the extras that bring them."""

import importlib.util

EXTRAS = {"nsga2": ("pymoo", "baselines"), "ompl": ("ompl", "baselines")}
"""Component → the package that it needs, and the extra of evoexp that brings it."""


def lacking(config_json: bytes) -> str:
    """Return how to install what a condition needs and is not there; nothing if all is.

    Args:
        config_json: The condition's canonical form.
    """
    for component, (package, extra) in EXTRAS.items():
        is_used = f'"_target_":"{component}"'.encode() in config_json
        if is_used and importlib.util.find_spec(package) is None:
            return f"{component} needs pip install 'evoexp[{extra}]'"
    return ""
