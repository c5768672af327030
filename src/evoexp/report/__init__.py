"""The report of stored runs: results, statistics, claims and figures, from the outputs alone."""
