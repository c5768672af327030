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
HEADS = ("work", "ours", "per", "rate [1/s]", "reference", "its time", "ratio")


def pair(values: dict[str, float]) -> str:
    """Return minimum and median, each in the unit that gives it one to three digits."""
    texts = []
    for seconds in (values["min"], values["median"]):
        factor, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
        texts.append(f"{seconds / factor:.3g} {unit}")
    return " · ".join(texts)


def machine(info: dict[str, Any]) -> str:
    """Return the machine and the versions that the times depend on."""
    cpu, names = info["cpu"], ("numpy", "scipy", "numba", "pin", "coal")
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    python = f"Python {platform.python_version()}"
    return f"{cpu['brand_raw']}, {cpu['count']} cores · {python}, {versions}"


def measured(result: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what `beside` noted of every benchmark."""
    return [b["extra_info"] for b in result["benchmarks"] if "work" in b["extra_info"]]


def ratio_table(result: dict[str, Any]) -> Table:
    """Return a row per reference of every benchmark, times per unit of work."""
    title = "Processor time per unit of work: minimum · median. Ratios of interleaved rounds."
    table = Table(*HEADS, title=title, title_justify="left")
    for info in measured(result):
        ours = (info["work"], pair(info["ours"]), info["unit"], f"{1.0 / info['ours']['min']:.3g}")
        for name, row in info["references"].items():
            ratios = f"{row['of_minima']:.3g} · {row['median']:.3g}"
            table.add_row(*ours, name, pair(row["time"]), ratios)
            ours = ("", "", "", "")
        if not info["references"]:
            table.add_row(*ours)
    return table


def found_ratios(result: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Return work and reference → the median ratio of a run's rounds, and its noise."""
    return {
        f"{info['work']} | {name}": {"ratio": row["median"], "noise": row["noise"]}
        for info in measured(result)
        for name, row in info["references"].items()
    }


def update(result: dict[str, Any]) -> None:
    """Write the ratios of a run; those of benchmarks that were left out stay."""
    kept = json.loads(KEPT.read_text())["ratios"] if KEPT.exists() else {}
    ratios = dict(sorted((kept | found_ratios(result)).items()))
    table = {"machine": machine(result["machine_info"]), "ratios": ratios}
    KEPT.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")


def check(result: dict[str, Any]) -> int:
    """Compare a run with the kept ratios; return 1 if one is worse, else 0."""
    kept, found = json.loads(KEPT.read_text()), found_ratios(result)
    if kept["machine"] != machine(result["machine_info"]):
        print(f"kept ratios are of another machine: {kept['machine']}")
    compared, num_worse = sorted(kept["ratios"].keys() & found.keys()), 0
    for name in compared:
        then, now = kept["ratios"][name], found[name]
        least = then["ratio"] * (1.0 - MARGIN * then["noise"])
        if now["ratio"] * (1.0 + MARGIN * now["noise"]) < least:
            num_worse += 1
            texts = (f"{row['ratio']:.3g} (noise {row['noise']:.1%})" for row in (now, then))
            print(f"slower: {name}: {', was '.join(texts)}")
    new = len(found) - len(compared)
    print(f"{len(compared)} ratios compared, {new} new ones, {num_worse} worse")
    return 1 if num_worse else 0


def main(path: Path, mode: str) -> int:
    """Print the table and CPU seconds of a result; compare it with the kept ratios, or keep it."""
    result = json.loads(path.read_text())
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(machine(result["machine_info"]))
    console.print(ratio_table(result))
    for info in measured(result):
        if cpu := info.get("cpu_s"):
            seconds = f"CPU {cpu['min']:.3f} s · {cpu['median']:.3f} s"
            console.print(f"{info['work']}: {seconds} over {cpu['replicates']} replicates")
    console.print(f"[dim]{path}[/dim]")
    if mode == "--update":
        update(result)
    return check(result) if mode == "--check" else 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else ""))
