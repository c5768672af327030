"""CPU time, memory and files that replicates cost beside their planner, by how many there are.

    python tests/benchmarks/measure_batches.py 100 1000 10000 [--dask]

Each batch of the cheapest shipped condition (`rana_planar`, multi-start, smoke budget) runs in an
empty store of its own, in processes whose CPU time is counted whoever started them; then comes the
same command with nothing to run, and `list`. Kernels are compiled before.
"""

import argparse
import ctypes
import os
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq

CONDITION = ("experiment=rana_planar", "budget=smoke", "--only", "multi-start", "--no-report")
TO_MEGABYTES = 1e-3  # of what the system counts in
LOOK_S = 0.02  # [s] between two looks at the process
SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER: orphans of a command are this process's to count


class Spent(NamedTuple):
    """Resources of a command."""

    wall_s: float  # [s]
    cpu_s: float  # of all of its processes [s]
    main_s: float  # CPU time of its own process, which writes what comes back [s]
    memory_mb: float  # peak of its own process [MB]


def spent(outputs: Path, *words: str) -> Spent:
    """Run a command, wait for it and for whatever it started, and add up."""
    started = time.monotonic()
    command = os.posix_spawn(
        sys.executable,
        [sys.executable, "-m", "evoexp", *words],
        {**os.environ, "EVOEXP_OUTPUTS": str(outputs)},
        file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)],
    )
    wall = cpu = main = memory = 0.0
    while True:
        with suppress(OSError, IndexError):  # gone, or no longer anything in memory
            main, memory = _own(command)
        try:
            process, status, used = os.wait4(-1, os.WNOHANG)
        except ChildProcessError:
            return Spent(wall, cpu, main, memory)
        if process == 0:
            time.sleep(LOOK_S)
            continue
        cpu += used.ru_utime + used.ru_stime  # with those it waited for itself
        if process == command:
            wall = time.monotonic() - started
            if status != 0:
                raise SystemExit(f"{' '.join(words)} ended with status {status}")


def _own(process: int) -> tuple[float, float]:
    """Return the CPU time [s] and the peak memory [MB] of a process by itself."""
    _, _, fields = Path(f"/proc/{process}/stat").read_text().rpartition(") ")
    ticks = sum(int(ticks) for ticks in fields.split()[11:13])
    peak = Path(f"/proc/{process}/status").read_text().split("VmHWM:")[1].split()[0]
    return ticks / os.sysconf("SC_CLK_TCK"), int(peak) * TO_MEGABYTES


def batch(count: int, runner: str) -> dict[str, str]:
    """Run so many replicates; return a row of the table."""
    with tempfile.TemporaryDirectory() as folder:
        outputs = Path(folder)
        asked = (*CONDITION, f"num_replicates={count}", f"budget.max_replicates={count}")
        asked = (*asked, f"runner={runner}")
        first = spent(outputs, "run", *asked)
        (summary,) = outputs.glob("runs/*/summary.parquet")
        planner = sum(pq.read_table(summary, columns=["cpu_s"])["cpu_s"].to_pylist())
        size = sum(path.stat().st_blocks * 512 for path in outputs.rglob("*"))
        again, listed = spent(outputs, "run", *asked), spent(outputs, "list")
    return {
        "replicates": f"{count:,}".replace(",", " "),
        "time": f"{first.wall_s:.1f} s",
        "CPU time of all processes": f"{first.cpu_s:.1f} s",
        "of it planners": f"{planner:.1f} s",
        "the rest per replicate": f"{1e3 * (first.cpu_s - planner) / count:.2f} ms",
        "main process": f"{first.main_s:.1f} s",
        "its peak memory": f"{first.memory_mb:.0f} MB",
        "on disk": f"{size / 1e6:.1f} MB",
        "again": f"{again.wall_s:.1f} s",
        "list": f"{listed.wall_s:.1f} s",
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Measure what replicates cost.")
    parser.add_argument("counts", nargs="+", type=int)
    parser.add_argument("--dask", action="store_true", help="a cluster on this machine, not loky")
    arguments = parser.parse_args()
    ctypes.CDLL(None).prctl(SUBREAPER, 1, 0, 0, 0)
    runner = "dask" if arguments.dask else "loky"
    with tempfile.TemporaryDirectory() as folder:  # compiles
        spent(Path(folder), "run", *CONDITION, f"runner={runner}")
    for k, count in enumerate(arguments.counts):
        row = batch(count, runner)
        if k == 0:
            print(f"| {' | '.join(row)} |\n|{' --- |' * len(row)}")
        print(f"| {' | '.join(row.values())} |", flush=True)


if __name__ == "__main__":
    main()
