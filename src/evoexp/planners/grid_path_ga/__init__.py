"""Paths on grids (Chen & Zalzala 1995, section 2)."""
