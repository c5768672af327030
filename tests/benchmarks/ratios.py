"""The result of `scripts/benchmark` as one table: work | ours | reference | ratio."""

import json
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

WIDTH = 150  # [characters] where the output is no terminal
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


def duration(seconds: float) -> str:
    """Return a time in the unit that gives it one to three digits before the point."""
    factor, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f"{seconds / factor:.3g} {unit}"


def pair(values: dict[str, float]) -> str:
    """Return minimum and median."""
    return f"{duration(values['min'])} · {duration(values['median'])}"


def machine(info: dict[str, Any]) -> str:
    """Return the machine and the versions that the times depend on."""
    cpu = info["cpu"]
    versions = ", ".join(
        f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "pin", "coal")
    )
    return (
        f"{cpu['brand_raw']}, {cpu['count']} cores · Python {platform.python_version()}, {versions}"
    )


def ratio_table(benchmarks: list[dict[str, Any]]) -> Table:
    """Return a row per reference of every benchmark that has one, times per unit of work."""
    table = Table(
        title="Times per unit of work: minimum · median. Ratios of interleaved rounds.",
        title_justify="left",
    )
    table.add_column("work")
    table.add_column("ours", justify="right", no_wrap=True)
    table.add_column("per")
    table.add_column("rate [1/s]", justify="right")
    table.add_column("reference")
    table.add_column("its time", justify="right", no_wrap=True)
    table.add_column("ratio", justify="right", no_wrap=True)
    for info in (b["extra_info"] for b in benchmarks if "work" in b["extra_info"]):
        ours = (info["work"], pair(info["ours"]), info["unit"], f"{1.0 / info['ours']['min']:.3g}")
        for name, row in info["references"].items():
            table.add_row(
                *ours, name, pair(row["time"]), f"{row['of_minima']:.3g} · {row['median']:.3g}"
            )
            ours = ("", "", "", "")
        if not info["references"]:
            table.add_row(*ours)
    return table


def main(path: Path) -> None:
    """Print the table, the CPU seconds of a replicate.

    And the times of the benchmarks without a ratio.
    """
    result = json.loads(path.read_text())
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(machine(result["machine_info"]))
    console.print(ratio_table(result["benchmarks"]))
    for benchmark in result["benchmarks"]:
        if cpu := benchmark["extra_info"].get("cpu_s"):
            what = benchmark["extra_info"]["work"]
            console.print(
                f"{what}: CPU {cpu['min']:.3f} s · {cpu['median']:.3f} s over {cpu['replicates']} "
                "replicates"
            )
    alone = [b for b in result["benchmarks"] if "work" not in b["extra_info"]]
    if alone:
        table = Table(title="Times per call: minimum · median.", title_justify="left")
        table.add_column("benchmark")
        table.add_column("time", justify="right")
        for benchmark in alone:
            table.add_row(benchmark["name"], pair(benchmark["stats"]))
        console.print(table)
    console.print(f"[dim]{path}[/dim]")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
