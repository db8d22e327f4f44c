"""The best sequence that a method has so far, and who is told about it."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem.method import Options, Progress
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.sequence_cost import true_cost


class Incumbent:
    """The cheapest sequence so far, from a given one onwards.

    Attributes:
        oriented: int32 (n,), oriented toolpaths.
        cost: what it costs, mm or s.
        lower_bound: no sequence costs less.
    """

    def __init__(self, problem: Problem, options: Options, oriented: NDArray[np.int32]) -> None:
        self._options = options
        self._problem = problem
        self._objective = options.objective
        self.oriented = oriented
        self.cost = self.price(self.oriented)
        self.lower_bound = 0.0

    def price(self, oriented: NDArray[np.int32]) -> float:
        """What a sequence costs."""
        return true_cost(self._problem, self._objective, oriented)

    def offer(self, oriented: NDArray[np.int32] | None) -> bool:
        """Take a sequence if it is cheaper."""
        if oriented is None:
            return False
        cost = self.price(oriented)
        if cost >= self.cost:
            return False
        self.oriented, self.cost = oriented, cost
        return True

    def raise_bound(self, bound: float) -> None:
        """Take a lower bound on all sequences, or on all that are cheaper than the incumbent."""
        self.lower_bound = max(self.lower_bound, min(bound, self.cost))

    @property
    def proved(self) -> bool:
        """Whether nothing is cheaper."""
        return self.lower_bound >= self.cost

    def report(self, stage: str, *, bounded: bool = True) -> None:
        """Say how things stand, if anyone listens."""
        if self._options.progress is not None:
            bound = (self.lower_bound or None) if bounded else None
            self._options.progress(Progress(stage, self.cost, bound, self.oriented))
