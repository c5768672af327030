"""Small stored runs of the shipped experiments, run once per test session."""

from report_samples import results, settings, stored  # noqa: F401
