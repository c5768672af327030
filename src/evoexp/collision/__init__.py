"""Collision: batched kernels of the papers' own models, and exact distances by coal."""
