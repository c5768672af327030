"""Rana & Zalzala 1995: two arms as strings of via-points."""
