"""Corsépius 2001: postures as individuals."""
