"""Sphere covers of bodies, and shapes within bodies."""
