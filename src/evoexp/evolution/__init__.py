"""Evolution: selection, crossover and what else the planners share; pure functions over arrays."""
