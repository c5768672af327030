"""Motions to watch, made on demand from the solution in a replicate's log.

`recording` turns a solution into one neutral record: the bodies, their poses tick by tick, their
distances, and the times at which they touch. `player_page`, `playable_log` and `trajectory` write
that record in their formats. No identity and no digest depends on this package.
"""
