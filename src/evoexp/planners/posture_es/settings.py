"""Hyperparameters of evolution strategies."""

from typing import ClassVar, Literal, Self

from pydantic import model_validator

from evoexp.validation import Component, Count, NonNegativeCount, Positive, Rate


class StrategySettings(Component):
    """A (μ, λ) or (μ + λ) evolution strategy."""

    component: ClassVar[str] = "strategy"

    num_parents: Count  # μ: individuals selected for the next cycle
    num_offspring: Count  # λ: individuals generated per cycle
    initial_size: Count  # individuals generated in the first cycle, from the start alone
    # individuals added at random per cycle (Algorithm 1, the set Q)
    num_immigrants: NonNegativeCount
    num_generations: NonNegativeCount  # cycles per phase of a task, at most
    patience: Count  # cycles without improvement after which the search is given up
    # `comma`: the next parents are offspring; `plus`: parents may stay
    selection: Literal["comma", "plus"]
    # `uniform` in a box of ±scope around the parent; `gaussian` with the standard deviation
    # below
    mutation: Literal["uniform", "gaussian"]
    mutation_std: Positive  # of Gaussian mutation, in units of the scope [-]
    # `equal` shares for all parents, or `gaussian`: the better the rank the more offspring
    parent_choice: Literal["equal", "gaussian"]
    parent_std: Positive  # of Gaussian parent choice, in units of μ [-]
    crossover_rate: Rate  # probability that a child takes every joint from one of two parents

    @model_validator(mode="after")
    def _parents_fit(self) -> Self:
        fits = self.num_parents <= self.num_offspring + self.num_immigrants
        must = f"at most num_offspring ({self.num_offspring}) with comma selection"
        self.demand("num_parents", fits or self.selection == "plus", must)
        return self

    @property
    def population_size(self) -> int:
        """Individuals judged before the first cycle: the start."""
        return 1
