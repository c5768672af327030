"""Geometry of strings of via-points, as compiled kernels over whole populations.

Lanes innermost.
"""
