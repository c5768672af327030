"""The result of `scripts/benchmark` as one table: work | ours | reference | ratio.

`ratios.json` keeps the ratios of an earlier run with the noise that they had. A ratio counts as
worse when it and the kept one are apart by more than `MARGIN` times the noise of each.
"""

import json
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

KEPT = Path(__file__).parent / "ratios.json"
MARGIN = 3.0  # [-] times the noise: half of the interquartile range of a run's rounds
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
        title="Processor time per unit of work: minimum · median. Ratios of interleaved rounds.",
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


def found_ratios(benchmarks: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Return work and reference → the median ratio of a run's rounds, and its noise."""
    return {
        f"{info['work']} | {name}": {"ratio": row["median"], "noise": row["noise"]}
        for info in (b["extra_info"] for b in benchmarks if "work" in b["extra_info"])
        for name, row in info["references"].items()
    }


def worse(kept: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """Return a line per ratio that is worse than the kept one by more than both noises allow."""
    lines = []
    for name in sorted(kept.keys() & found.keys()):
        then, now = kept[name], found[name]
        least = then["ratio"] * (1.0 - MARGIN * then["noise"])
        most = now["ratio"] * (1.0 + MARGIN * now["noise"])
        if most < least:
            lines.append(
                f"slower: {name}: {now['ratio']:.3g} (noise {now['noise']:.1%}), was "
                f"{then['ratio']:.3g} (noise {then['noise']:.1%})"
            )
    return lines


def update(result: dict[str, Any]) -> None:
    """Write the ratios of a run; those of benchmarks that were left out stay."""
    kept = json.loads(KEPT.read_text())["ratios"] if KEPT.exists() else {}
    ratios = dict(sorted((kept | found_ratios(result["benchmarks"])).items()))
    table = {"machine": machine(result["machine_info"]), "ratios": ratios}
    KEPT.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")


def check(result: dict[str, Any]) -> int:
    """Compare a run with the kept ratios; return 1 if one is worse, else 0."""
    kept = json.loads(KEPT.read_text())
    found = found_ratios(result["benchmarks"])
    here = machine(result["machine_info"])
    if kept["machine"] != here:
        print(f"kept ratios are of another machine: {kept['machine']}")
    lines = worse(kept["ratios"], found)
    print(*lines, sep="\n")
    new = len(found.keys() - kept["ratios"].keys())
    print(f"{len(found) - new} ratios compared, {new} new ones, {len(lines)} worse")
    return 1 if lines else 0


def main(path: Path, mode: str) -> int:
    """Print the table, the CPU seconds of a replicate, and the times of what has no ratio.

    Args:
        path: Result of pytest-benchmark.
        mode: `--check`: compare with the kept ratios; `--update`: keep these; or empty.
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
    if mode == "--update":
        update(result)
    return check(result) if mode == "--check" else 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else ""))
