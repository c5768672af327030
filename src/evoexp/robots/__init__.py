"""Robots: descriptions that build a Pinocchio model, coal geometry and a kinematic table."""
