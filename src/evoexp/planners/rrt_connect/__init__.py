"""Motions of arms by two trees of random configurations (Kuffner & LaValle 2000)."""
