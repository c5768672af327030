"""Redundant planar arms among ellipses (Lavoie & Boudreau 2001)."""
