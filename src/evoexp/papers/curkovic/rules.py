"""The claims of Curkovic et al. 2013 with their rules, from `claims.yaml`."""

from pathlib import Path

from evoexp.report.kit import read_rules

RULES = read_rules(Path(__file__).with_name("claims.yaml"))
