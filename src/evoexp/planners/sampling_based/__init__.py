"""Motions of arms by straight edges between random configurations: RRT-Connect, and OMPL."""
