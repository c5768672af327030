"""A table of the replicates of a stored run."""

from rich.table import Table
from rich.text import Text

from evoexp.commands.console import add_columns, new_table
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table


def replicate_table(run: RunDirectory) -> Table:
    """Return one row per replicate, done or failed."""
    table = new_table(f"replicates in {run.path}")
    add_columns(table, "#", right=True)
    add_columns(table, "status")
    numbers = ("best cost", "solved", "certified", "clearance", "evaluations", "CPU s")
    add_columns(table, *numbers, right=True)
    add_columns(table, "digest, or why it failed")
    for row in summary_table(run).to_pylist():
        if row["status"] != "done":
            failed = Text("failed", "red")
            table.add_row(str(row["replicate"]), failed, *6 * ["–"], str(row["stop_reason"]))
            continue
        verdict = ["–" if row[name] is None else str(row[name]) for name in ("solved", "certified")]
        effort = [f"{row['clearance']:.4g}", str(row["evaluations"]), f"{row['cpu_s']:.3f}"]
        cells = [f"{row['best_cost']:.6g}", *verdict, *effort]
        table.add_row(str(row["replicate"]), "done", *cells, str(row["digest"]))
    return table
