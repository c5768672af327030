"""Collision models of the planners: the papers' own."""
