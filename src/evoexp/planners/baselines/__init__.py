"""Planners to compare the papers' with."""
