"""Figures: from results to a tidy table, from that table to a matplotlib Figure; no file access."""
