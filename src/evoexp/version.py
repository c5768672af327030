"""The version of evoexp, on the lowest floor: whoever needs it imports nothing else."""

__version__ = "0.1.0"
