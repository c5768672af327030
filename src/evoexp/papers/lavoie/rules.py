"""Lavoie & Boudreau 2001: its claims with their rules, and the words of its pages."""

from pathlib import Path

from evoexp.papers.paper import read_paper
from evoexp.report.kit import read_rules

RULES = read_rules(Path(__file__).with_name("claims.yaml"))
PAPER = read_paper(Path(__file__).with_name("words.yaml"))
