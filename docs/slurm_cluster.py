"""Start workers on a Slurm cluster, run an experiment on them, end them.

    python slurm_cluster.py --jobs 8 --cores 16 -- experiment=lavoie num_replicates=100000

Needs `pip install 'evoexp[cluster]'` here and on the nodes, in the same version.
"""

import argparse
import subprocess
import sys

from dask_jobqueue import SLURMCluster
from distributed import Client


def main() -> int:
    """Run the experiment; its exit code is ours."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", type=int, default=2, help="Slurm jobs")
    parser.add_argument("--cores", type=int, default=4, help="of each job; one worker per core")
    parser.add_argument("--memory", default="8GB", help="of each job")
    parser.add_argument("--walltime", default="02:00:00")
    parser.add_argument("--queue", default=None)
    parser.add_argument("--interface", default=None, help="network between nodes: ib0, eth0, …")
    parser.add_argument("overrides", nargs="+", help="as for evoexp run")
    given = parser.parse_args()
    with SLURMCluster(
        cores=given.cores,
        processes=given.cores,  # one replicate at a time per process
        memory=given.memory,
        walltime=given.walltime,
        queue=given.queue,
        interface=given.interface,
        python=sys.executable,
    ) as cluster:
        cluster.scale(jobs=given.jobs)
        with Client(cluster) as client:
            client.wait_for_workers(1)  # the others join when Slurm starts them
        command = [sys.executable, "-m", "evoexp", "run", *given.overrides]
        where = ["runner=dask", f"runner.address={cluster.scheduler_address}"]
        return subprocess.call([*command, *where])


if __name__ == "__main__":
    sys.exit(main())
