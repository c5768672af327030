"""The exact certifier: verdicts on whole continuous motions."""
