"""my_planner: a planner for evoexp."""
