"""Hydra composes a choice of options once per test process, as long as no option file changes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from evoexp.configuration import compose
from evoexp.configuration.search_path import folders


@contextmanager
def compositions_remembered() -> Iterator[None]:
    """Remember what Hydra composed; nothing that evoexp itself does with it."""
    compositions = dict[Any, compose.Composed]()
    by_hydra = compose.Composer.by_hydra

    def remembered(composer: Any, words: list[str]) -> compose.Composed:
        roots = [composer.root, *(folder.path for folder in folders())]
        files = [path for root in roots for path in root.glob("*/*.yaml")]
        state = [(path.name, path.stat().st_mtime_ns) for path in sorted(files)]
        key = (*words, composer.file, *(folder.path for folder in folders()), *state)
        if key not in compositions:
            compositions[key] = by_hydra(composer, words)
        return compositions[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compose.Composer, "by_hydra", remembered)
        yield
