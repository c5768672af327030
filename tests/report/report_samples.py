"""Small experiments to report on."""

from pathlib import Path

from evoexp import compose
from evoexp.batch.replicate import run_replicate
from evoexp.store.manifest import manifest
from evoexp.store.run_directory import RunDirectory

SMALL = ("budget=smoke", "ga.population_size=12", "ga.num_generations=4", "num_replicates=2")
REPORT = {
    "formats": ("svg", "png"),
    "dpi": 60,
    "confidence": 0.95,
    "significance": 0.05,
    "num_resamples": 200,
    "samples_per_segment": 10,
    "threshold_ratio": 1.25,
}


def expand(name: str, *overrides: str) -> compose.Experiment:
    """Return an experiment, small."""
    words = {word.split("=")[0]: word for word in (*SMALL, *overrides)}
    return compose.expand([f"experiment={name}", *words.values()])[0]


def store(outputs: Path, experiment: compose.Experiment) -> None:
    """Run and store every replicate of an experiment."""
    for label, condition in experiment.conditions:
        run = RunDirectory(outputs, condition.id)
        run.create(condition.to_json(), manifest(condition.id) | {"label": label})
        for replicate in range(experiment.num_replicates):
            run.write_log(replicate, run_replicate(condition, replicate).content)
