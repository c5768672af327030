"""Stored runs, and what is read and measured of them."""
