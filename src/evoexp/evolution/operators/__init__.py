"""Operators of evolution: components that a configuration names, each with one kernel."""
