"""Stored results as pandas frames, for use in Python."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from evoexp.configuration import compose
from evoexp.configuration.search_path import is_file, options, searched_first
from evoexp.errors import NothingStored, UnknownHash, UnknownOption
from evoexp.store.identity import ORIGIN, run_context
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve
from evoexp.store.summaries import read_generations, read_summaries

SEED = "seed"


class Frames(NamedTuple):
    """Results of one or several conditions."""

    # one row per generation of every finished replicate, columns of
    # `evoexp.records.GenerationRow`
    generations: pd.DataFrame
    # one row per replicate, done or failed, columns of `evoexp.records.ReplicateSummary`, `seed`,
    # and the settings in which the conditions differ, by the names that they have in
    # `summary.parquet`
    summaries: pd.DataFrame

    def __repr__(self) -> str:
        """Return the conditions and the size of each frame."""
        keys = self.summaries[["label", "condition"]].value_counts(sort=False).reset_index()
        rows = [
            f"  {label}  {key[:12]}  {count} replicates"
            for label, key, count in keys.itertuples(index=False)
        ]
        sizes = [
            f"{name}: {len(frame)} rows × {len(frame.columns)} columns"
            for name, frame in self._asdict().items()
        ]
        return "\n".join([", ".join(sizes), *rows])

    def _repr_html_(self) -> str:
        groups = self.summaries.groupby(["label", "condition"], sort=False)
        table = groups.agg(
            replicates=("replicate", "size"),
            solved=("solved", "sum"),
            median_best_cost=("best_cost", "median"),
        ).reset_index()
        return str(table.assign(condition=table["condition"].str[:12]).to_html(index=False))


def load(
    what: str,
    *overrides: str,
    budget: str = "paper",
    multirun: bool = False,
    outputs: Path | str | None = None,
    config_dir: Sequence[Path | str] = (),
) -> Frames:
    """Load the stored results of an experiment, or of one run by its hash.

    Examples:
        >>> frames = evoexp.load("rana_planar", budget="smoke")  # or a hash: evoexp.load("4da921")
        >>> frames.summaries.groupby("label")[["best_cost", "cpu_s"]].median()

    Args:
        what: Name or file of an experiment, or any unique prefix of a run's hash.
        overrides: Changes of the experiment, as on the command line.
        budget: Name of the experiment's budget: `paper`, `quick`, `smoke`.
        multirun: Whether overrides with commas are swept over.
        outputs: Root of the outputs; by default `EVOEXP_OUTPUTS` or `outputs`.
        config_dir: Folders of options that are searched before all others.

    Returns:
        Frames whose column `label` names the condition as the figures do, `condition` by its hash.

    Raises:
        UnknownOption: If `what` is neither an experiment nor a hash.
        UnknownHash: If no stored run has this hash.
        AmbiguousHash: If several runs begin with it.
        NothingStored: If no run of it is stored.

    Warns:
        DamagedStore: If a log is damaged; it is left out.
    """
    root = Path(outputs) if outputs is not None else outputs_root()
    with searched_first(map(str, config_dir)):
        known = options("experiment")
        words = [f"experiment={what}", f"budget={budget}", *overrides]
        is_experiment = what in known or is_file(what)
        experiments = compose.expand(words, multirun=multirun) if is_experiment else []
    if experiments:
        labels = [(c.label, c.condition.id) for e in experiments for c in e.conditions]
        runs = [RunDirectory(root, key) for key in dict.fromkeys(key for _, key in labels)]
        runs = [run for run in runs if run.completed() or run.failed()]
        if not runs:
            raise NothingStored(
                f"{what}: nothing stored in {root}; run it: evoexp run experiment={what}"
            )
    else:
        try:
            run = resolve(root, what)
        except UnknownHash:
            if re.fullmatch("[0-9a-fA-F]{1,64}", what):
                raise
            raise UnknownOption("experiment or hash", what, known) from None
        label = run.origin()["label"] or run.hash12
        runs, labels = [run], [(label, run.condition_id)]
    summaries = read_summaries(runs, thorough=True)  # first: what is damaged is left out
    summaries = summaries.assign(**_settings(runs, summaries))
    return Frames(_labelled(read_generations(runs), labels), _labelled(summaries, labels))


def _settings(runs: Sequence[RunDirectory], summaries: pd.DataFrame) -> dict[str, pd.Series]:
    contexts = {
        run.condition_id: run_context(run.path, run.condition_id, summaries.columns) for run in runs
    }
    names = dict.fromkeys(name for context in contexts.values() for name in context)
    values = {name: [context.get(name) for context in contexts.values()] for name in names}
    return {
        name: summaries["condition"].map(dict(zip(contexts, own, strict=True)))
        for name, own in values.items()
        if name == SEED or (name not in ORIGIN and any(value != own[0] for value in own))
    }


def _labelled(frame: pd.DataFrame, labels: list[tuple[str, str]]) -> pd.DataFrame:
    """Add the label in front, with the rows in the order of the labels."""
    parts = [frame[frame["condition"] == key].assign(label=label) for label, key in labels]
    whole = pd.concat(parts, ignore_index=True)
    return whole[["label", *frame.columns]]
