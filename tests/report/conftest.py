"""Small stored runs of the shipped experiments, run once per test session."""

from report_samples import results as results
from report_samples import settings as settings
from report_samples import stored as stored
