"""Strings of via-points (Rana & Zalzala 1995)."""
