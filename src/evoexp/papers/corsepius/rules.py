"""The rules by which the claims of Corsépius 2001 are judged, read from `claims.yaml`."""

from pathlib import Path

from evoexp.report.kit import read_rules

RULES = read_rules(Path(__file__).with_name("claims.yaml"))
