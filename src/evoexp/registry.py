"""The registry: names of the components, pages and claims that installed packages bring.

A package declares entry points in its metadata. Four groups are read:

- `evoexp.components`: name → `module:class`, the components that a configuration may name;
- `evoexp.pages`: name → `package:page.yaml`, or `module:function`, the pages that `report.figures`
  may name;
- `evoexp.claims`: paper → `package:claims.yaml`, its claims with their rules;
- `evoexp.conf`: any name → `package:folder`, a folder of options (see `configuration.search_path`).

A configuration is data: it can name registered components only, even if it comes from somebody
else's log. The components and pages of a guest package have names that begin with the package's
name: the distribution `my-planner` may register `my_planner` and `my_planner_…`.
"""

import functools
import importlib
import importlib.metadata
import importlib.util
import json
import re
from collections.abc import Iterator, Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any, NamedTuple, cast

from evoexp.errors import RegistrationError, SettingError, nearest
from evoexp.validation import TARGET, Component

COMPONENTS, PAGES = "evoexp.components", "evoexp.pages"
CLAIMS, CONF = "evoexp.claims", "evoexp.conf"
OWN = "evoexp"  # the distribution whose names are free
EXTRAS = {"nsga2": ("pymoo", "baselines"), "ompl": ("ompl", "baselines")}
"""Component → the package that it needs, and the extra of evoexp that brings it."""


class Registration(NamedTuple):
    """A name that an installed distribution registers."""

    name: str  # of a component, a page or a folder
    target: str  # `module:attribute`
    distribution: str  # as its metadata spell it, `my-planner`
    version: str  # of the distribution

    @property
    def is_own(self) -> bool:
        """Whether evoexp itself registers it."""
        return self.distribution == OWN

    @property
    def package(self) -> str:
        """Distribution and version, `my-planner 0.3`."""
        return f"{self.distribution} {self.version}"

    @property
    def module(self) -> str:
        """Module that the name's class or function is in."""
        return self.target.partition(":")[0]

    @property
    def file(self) -> Traversable | None:
        """The file that the name stands for, in its package; None: it is an attribute."""
        package, _, name = self.target.partition(":")
        return resources.files(package).joinpath(name) if name.endswith(".yaml") else None

    def load(self) -> Any:
        """Import and return the class or function."""
        module, _, attribute = self.target.partition(":")
        try:
            return getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError) as error:
            raise RegistrationError(
                f"{self.name}: {self.package} registers {self.target}, which cannot be imported "
                f"({error})"
            ) from error


def registrations(group: str) -> tuple[Registration, ...]:
    """Return all registrations of an entry-point group, in alphabetical order."""
    return _registrations()[group]


@functools.cache
def _registrations() -> dict[str, tuple[Registration, ...]]:
    """Read the metadata of all installed distributions, once per process."""
    found: dict[str, list[Registration]] = {
        group: [] for group in (COMPONENTS, PAGES, CLAIMS, CONF)
    }
    seen = set()
    for distribution in importlib.metadata.distributions():
        points = [point for point in distribution.entry_points if point.group in found]
        if points and (name := distribution.metadata["Name"]) not in seen:  # the first on the path
            seen.add(name)
            version = distribution.version  # read out of the metadata whenever it is asked for
            for point in points:
                target = point.value.replace(" ", "")
                found[point.group].append(Registration(point.name, target, name, version))
    if OWN not in seen:
        raise RegistrationError("evoexp: is not installed (in its checkout: pip install -e .)")
    return {group: tuple(sorted(each)) for group, each in found.items()}


def clear() -> None:
    """Forget the metadata, so that they are read again."""
    _registrations.cache_clear()
    guests.cache_clear()


def names(group: str) -> list[str]:
    """Return all names of a group, in alphabetical order."""
    return sorted({registration.name for registration in registrations(group)})


def registered(group: str, name: str) -> Registration | None:
    """Return the registration of a name; None if nobody registers it.

    Raises:
        RegistrationError: If two distributions register the name, or a guest's name does not begin
            with the name of its distribution.
    """
    found = [each for each in registrations(group) if each.name == name]
    if len(found) > 1:
        packages = " and ".join(each.package for each in found)
        raise RegistrationError(f"{name}: registered by {packages}; uninstall all but one of them")
    if found and not found[0].is_own:
        prefix = re.sub(r"[-_.]+", "_", found[0].distribution).lower()
        if name != prefix and not name.startswith(f"{prefix}_"):
            raise RegistrationError(
                f"{name}: {found[0].package} must register names that begin with its own, "
                f"'{prefix}' or '{prefix}_{name}'"
            )
    return found[0] if found else None


def component_class(name: str, field: str = TARGET) -> type[Component]:
    """Return the class registered under a name; SettingError names the nearest if none is."""
    registration = registered(COMPONENTS, name)
    if registration is None:
        must = "a registered component"
        raise SettingError(f"{field}.{TARGET}", must, name, nearest(name, names(COMPONENTS)))
    return cast(type[Component], registration.load())


def components_in(config: Any, field: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (dotted field, settings) of all components in plain configuration data."""
    if isinstance(config, dict):
        if TARGET in config:
            yield field, config
        for key, value in config.items():
            yield from components_in(value, f"{field}.{key}" if field else str(key))
    elif isinstance(config, list):
        for k, value in enumerate(config):
            yield from components_in(value, f"{field}[{k}]")


@functools.lru_cache(maxsize=64)
def guests(config_json: bytes) -> dict[str, str]:
    """Return the guest components of a condition → their `distribution version`."""
    named = (str(settings[TARGET]) for _, settings in components_in(json.loads(config_json)))
    found = (registered(COMPONENTS, name) for name in named)
    return {each.name: each.package for each in found if each is not None and not each.is_own}


def missing(components: Mapping[str, str]) -> list[str]:
    """Return the packages of components (as `guests` gave them) that are not registered here."""
    known = names(COMPONENTS)
    return sorted({package for name, package in components.items() if name not in known})


def lacking(config_json: bytes) -> str:
    """Return how to install what a condition (canonical form) lacks; empty if it lacks nothing."""
    for component, (package, extra) in EXTRAS.items():
        is_used = f'"_target_":"{component}"'.encode() in config_json
        if is_used and importlib.util.find_spec(package) is None:
            return f"{component} needs pip install 'evoexp[{extra}]'"
    return ""
