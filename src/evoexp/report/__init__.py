"""Report: reads outputs only; results, statistics, claims and figures.

Never imports batch or planners.
"""
