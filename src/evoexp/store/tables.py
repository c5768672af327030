"""DataFrames of summaries and generations, over the tables and logs of runs."""

from collections.abc import Collection
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from evoexp.records import GenerationRow
from evoexp.store.log_reader import DTYPES, generation_columns
from evoexp.store.messages import field_types
from evoexp.store.summaries import Runs, distinct, summary_table, whole_logs


def read_summaries(runs: Runs, *, thorough: bool = False) -> pd.DataFrame:
    """Return the summaries of one or several runs, one row per replicate; see `summary_table`.

    Numbers and booleans are Arrow's (`double[pyarrow]`, …), in which ±inf, NaN and missing stay
    three things; text is pandas' own.
    """
    frame: pd.DataFrame = summary_table(runs, thorough=thorough).to_pandas(
        types_mapper=lambda kind: None if pa.types.is_string(kind) else pd.ArrowDtype(kind)
    )
    return frame


def read_generations(runs: Runs, replicates: Collection[int] | None = None) -> pd.DataFrame:
    """Return the generations of completed replicates of one or several runs.

    Damaged logs are left out; `read_summaries` says so.

    Returns:
        Columns condition (categorical), replicate, those of `GenerationRow` without its chain, and
        `term_<name>` in alphabetical order, NaN where a generation lacks the term.
    """
    directories = distinct(runs)
    codes, indices, parts = list[int](), list[int](), list[dict[str, NDArray[Any]]]()
    for code, run in enumerate(directories):
        done = whole_logs(run)
        for replicate in sorted(done if replicates is None else done.intersection(replicates)):
            parts.append(generation_columns(run.log_path(replicate)))
            codes.append(code)
            indices.append(replicate)
    heights = [len(part["index"]) for part in parts]
    categories = pd.Index([run.condition_id for run in directories], dtype="str")
    frame: dict[str, Any] = {
        "condition": pd.Categorical.from_codes(
            np.repeat(np.array(codes, dtype=np.int32), heights), categories
        ),
        "replicate": np.repeat(np.array(indices, dtype=np.int64), heights),
    }
    fields = field_types(GenerationRow).items()
    kinds = {name: DTYPES[kind] for name, kind in fields if name != "chain"}
    terms = {name for part in parts for name in part} - set(kinds)
    kinds |= dict.fromkeys(sorted(terms), np.float64)
    # a column leaves the parts when it is in the frame: nothing is there twice
    for name, kind in kinds.items():
        pieces = [
            part.pop(name) if name in part else np.full(height, np.nan)
            for part, height in zip(parts, heights, strict=True)
        ]
        frame[name] = np.concatenate([np.empty(0, dtype=kind), *pieces])
    return pd.DataFrame(frame, copy=False)
