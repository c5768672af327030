"""References: deterministic truths that are drawn beside planners."""
