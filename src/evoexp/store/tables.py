"""DataFrames of summaries and generations, over the tables and logs of runs."""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from evoexp.records import GenerationRow
from evoexp.store.log_reader import DTYPES, generation_columns
from evoexp.store.messages import field_types
from evoexp.store.summaries import Runs, distinct, summary_table, whole_logs

Columns = dict[str, NDArray[Any]]  # of some generations, by name
LOGS_AT_ONCE = 500  # whose columns are put one below another


def read_summaries(runs: Runs, *, thorough: bool = False) -> pd.DataFrame:
    """Return the summaries of one or several runs, one row per replicate; see `summary_table`.

    Args:
        runs: One or several.
        thorough: Whether the checksums of all logs are looked at: before they are read.

    Returns:
        Its columns. Numbers and booleans are Arrow's (`double[pyarrow]`, …), in which ±inf, NaN and
        missing stay three things; text is pandas' own.
    """
    frame: pd.DataFrame = summary_table(runs, thorough=thorough).to_pandas(
        types_mapper=lambda kind: None if pa.types.is_string(kind) else pd.ArrowDtype(kind)
    )
    return frame


def read_generations(runs: Runs, replicates: Collection[int] | None = None) -> pd.DataFrame:
    """Return the generations of completed replicates of one or several runs.

    Logs are read one after the other; of each only its columns are kept. Damaged ones are left
    out; `read_summaries` says so.

    Args:
        runs: One or several.
        replicates: Which ones of every run, done or not; None: all.

    Returns:
        Columns condition (categorical), replicate, those of `GenerationRow` without its chain, and
        `term_<name>` in alphabetical order, NaN where a generation lacks the term.

    Raises:
        CorruptLog: A log was damaged since `read_summaries` looked at all of them.
    """
    directories = distinct(runs)
    codes, indices, lengths, parts, recent = [], [], [], list[Columns](), list[Columns]()
    for code, run in enumerate(directories):
        done = whole_logs(run)
        for replicate in sorted(done if replicates is None else done.intersection(replicates)):
            recent.append(generation_columns(run.log_path(replicate)))
            lengths.append(len(recent[-1]["index"]))
            codes.append(code)
            indices.append(replicate)
            if len(recent) == LOGS_AT_ONCE:  # an array by itself takes more than its numbers
                parts.append(_one_below_another(recent))
                recent.clear()
    parts += recent
    categories = pd.Index([run.condition_id for run in directories], dtype="str")
    frame: dict[str, Any] = {
        "condition": pd.Categorical.from_codes(
            np.repeat(np.array(codes, dtype=np.int32), lengths), categories
        ),
        "replicate": np.repeat(np.array(indices, dtype=np.int64), lengths),
    }
    kinds = {
        name: DTYPES[kind] for name, kind in field_types(GenerationRow).items() if name != "chain"
    }
    kinds |= dict.fromkeys(
        sorted({name for columns in parts for name in columns} - set(kinds)), np.float64
    )
    heights = [len(columns["index"]) for columns in parts]
    # a column leaves the parts when it is in the frame: nothing is there twice
    for name, kind in kinds.items():
        pieces = (columns.pop(name, None) for columns in parts)
        filled = (
            np.full(length, np.nan) if piece is None else piece
            for piece, length in zip(pieces, heights, strict=True)
        )
        frame[name] = np.concatenate([np.empty(0, dtype=kind), *filled])
    return pd.DataFrame(frame, copy=False)


def _one_below_another(parts: Sequence[Columns]) -> Columns:
    """Return the columns of some logs as those of one log, NaN where a log lacks a term."""
    names = dict.fromkeys(name for part in parts for name in part)
    absent = [np.full(len(part["index"]), np.nan) for part in parts]
    return {
        name: np.concatenate(
            [part.get(name, missing) for part, missing in zip(parts, absent, strict=True)]
        )
        for name in names
    }
