"""Robots: descriptions that build a Pinocchio model, coal geometry and a kinematic table.

Whatever a setting or a file of a robot must not be is refused by a `SettingError`; the argument
`field` of a reader is the setting that it names.
"""
