"""Scenarios: obstacles, starts, goals, grids, as plain records."""
