"""Postures as individuals (Corsépius 2001)."""
