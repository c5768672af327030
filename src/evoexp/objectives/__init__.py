"""Objectives: the papers' criteria as batched functions over arrays; named terms out."""
