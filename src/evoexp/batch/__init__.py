"""Batch: runs seeded replicates, and runs them again to compare."""
