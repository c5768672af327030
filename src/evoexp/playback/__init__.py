"""Motions to watch: derived on demand from the solution in a replicate's log.

Nothing of it enters an identity.

`recording` makes of a solution one neutral record: what the bodies are, where they are tick by
tick, how far apart, and when they touch. `page`, `playable_log` and `trajectory` only write that
record down.
"""
