"""Robots: descriptions that build a Pinocchio model with coal geometry, and the kinematic table derived from it."""
