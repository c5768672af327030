"""Planners: one paper's algorithm, one file; each reads beside its paper from top to bottom."""
