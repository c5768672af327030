"""Lavoie & Boudreau 2001: redundant arms among ellipses."""
