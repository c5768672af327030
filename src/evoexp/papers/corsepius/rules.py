"""Corsépius 2001: its claims with their rules, and the words of its pages."""

from evoexp.report.kit import read_paper

PAPER, RULES = read_paper(__file__)
