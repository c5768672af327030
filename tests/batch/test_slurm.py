"""The script for Slurm runs an experiment, where `sbatch` starts its jobs on this machine."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp import shipped
from evoexp.store.summaries import summary_table
from store_lookup import find_runs

pytestmark = pytest.mark.skipif(  # not by importing it: that replaces this process' SIGINT handler
    importlib.util.find_spec("dask_jobqueue") is None,
    reason="needs dask-jobqueue, from evoexp[cluster]",
)
SCRIPT = Path(__file__).parents[2] / "docs" / "slurm_cluster.py"
SBATCH = """#!/bin/sh
cp "$1" "$JOBS.sh"  # the file is gone as soon as this script ends, as with Slurm
bash "$JOBS.sh" >"$JOBS.out" 2>&1 &
echo $! >>"$JOBS"
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
kill "$@" 2>/dev/null || true
"""


@pytest.mark.matrix
def test_an_experiment_runs_on_slurms_workers(tmp_path: Path) -> None:
    programs = tmp_path / "bin"
    programs.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (programs / name).write_text(text)
        (programs / name).chmod(0o755)
    around = os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "EVOEXP_OUTPUTS": str(tmp_path / "outputs"),
        "JOBS": str(tmp_path / "jobs"),
    }
    words = ["--jobs", "1", "--cores", "2", "--memory", "2GB", "--interface", "lo"]
    asked = ["experiment=rana_planar", "budget=smoke"]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *words, *asked],
        env=around,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "jobs").read_text().split()) == 1
    for run in find_runs(tmp_path / "outputs"):
        (row,) = {each.digest for each in shipped.find(run.hash12)}
        assert row in summary_table(run)["digest"].to_pylist()
    assert len(find_runs(tmp_path / "outputs")) == 3
