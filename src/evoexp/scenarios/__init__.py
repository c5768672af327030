"""Scenarios: obstacles, starts, goals, grids, as plain records.

Whatever a setting or a file of a scenario must not be is refused by a `SettingError`; the argument
`field` of a reader is the setting that it names.
"""
