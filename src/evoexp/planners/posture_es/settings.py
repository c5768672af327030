"""Hyperparameters of evolution strategies."""

from typing import ClassVar, Literal, Self

from pydantic import model_validator

from evoexp.errors import SettingError
from evoexp.validation import Component, Count, NonNegativeCount, Positive, Rate


class StrategySettings(Component):
    """A (μ, λ) or (μ + λ) evolution strategy.

    Attributes:
        num_parents: μ: individuals selected for the next cycle.
        num_offspring: λ: individuals generated per cycle.
        initial_size: Individuals generated in the first cycle, from the start alone.
        num_immigrants: Individuals added at random per cycle (Algorithm 1, the set Q).
        num_generations: Cycles per phase of a task, at most.
        patience: Cycles without improvement after which the search is given up.
        selection: `comma`: the next parents are offspring; `plus`: parents may stay.
        mutation: `uniform` in a box of ±scope around the parent; `gaussian` with the standard
            deviation below.
        mutation_std: Of Gaussian mutation, in units of the scope [-].
        parent_choice: `equal` shares for all parents, or `gaussian`: the better the rank the more
            offspring.
        parent_std: Of Gaussian parent choice, in units of μ [-].
        crossover_rate: Probability that a child takes every joint from one of two parents.
    """

    component: ClassVar[str] = "strategy"

    num_parents: Count
    num_offspring: Count
    initial_size: Count
    num_immigrants: NonNegativeCount
    num_generations: NonNegativeCount
    patience: Count
    selection: Literal["comma", "plus"]
    mutation: Literal["uniform", "gaussian"]
    mutation_std: Positive
    parent_choice: Literal["equal", "gaussian"]
    parent_std: Positive
    crossover_rate: Rate

    @model_validator(mode="after")
    def _parents_fit(self) -> Self:
        if (
            self.selection == "comma"
            and self.num_parents > self.num_offspring + self.num_immigrants
        ):
            raise SettingError(
                "num_parents",
                f"at most num_offspring ({self.num_offspring}) with comma selection",
                self.num_parents,
            )
        return self

    @property
    def population_size(self) -> int:
        """Individuals judged before the first cycle: the start."""
        return 1

    @property
    def num_evaluations(self) -> int:
        """Evaluations of a run that uses all cycles."""
        cycles = max(self.num_generations - 1, 0) * (self.num_offspring + self.num_immigrants)
        return 1 + cycles + min(self.num_generations, 1) * (self.initial_size + self.num_immigrants)
