"""Robots: descriptions that build a Pinocchio model with coal geometry.

And the kinematic table derived from it.
"""
