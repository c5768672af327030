"""The claims of Rana & Zalzala 1995 with their rules, from `claims.yaml`."""

from pathlib import Path

from evoexp.report.kit import read_rules

RULES = read_rules(Path(__file__).with_name("claims.yaml"))
