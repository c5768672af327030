"""Registrations: names, and the modules and packages that they come from."""

import pytest

from evoexp.registry import CLAIMS, COMPONENTS, PAGES, registrations


@pytest.mark.parametrize("group", [COMPONENTS, PAGES, CLAIMS])
def test_the_module_of_a_registration_holds_what_it_loads(group: str) -> None:
    own = [each for each in registrations(group) if each.is_own][:4]
    assert own
    for each in own:
        loaded = each.load()
        assert each.package.startswith("evoexp ")
        if hasattr(loaded, "__module__") and group != CLAIMS:  # claims are plain lists
            assert each.module == loaded.__module__
        assert each.module.startswith("evoexp.")
