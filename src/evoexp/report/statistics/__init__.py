"""Tests, intervals and comparisons of runs, and the verdicts that follow from them."""
