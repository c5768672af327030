"""Docking configurations of a mobile manipulator (Chen & Zalzala 1995, section 3)."""
