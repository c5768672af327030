"""Options that tests of this folder choose again and again are composed once."""

from typing import Any

import pytest

from evoexp.configuration import compose
from evoexp.configuration.search_path import folders

COMPOSED: dict[Any, compose.Composed] = {}


@pytest.fixture(autouse=True)
def composed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have Hydra compose no choice of options twice, as long as the files stay the same."""
    by_hydra = compose.Composer.by_hydra

    def remembered(composer: Any, words: list[str]) -> compose.Composed:
        roots = [composer.root, *(folder.path for folder in folders())]
        files = [path for root in roots for path in root.glob("*/*.yaml")]
        state = [(path.name, path.stat().st_mtime_ns) for path in sorted(files)]
        key = (*words, composer.file, *(folder.path for folder in folders()), *state)
        if key not in COMPOSED:
            COMPOSED[key] = by_hydra(composer, words)
        return COMPOSED[key]

    monkeypatch.setattr(compose.Composer, "by_hydra", remembered)
