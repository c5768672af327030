"""A crossover for evoexp."""
