"""Geometry of strings of via-points as kernels over whole populations, motions, and grids."""
