"""Planners: a package per algorithm, and the protocol that all of them keep."""
