"""The best sequence that a method has so far, and who is told about it."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.sequence.cost import Objective, direct_cost
from slicer.sequence.greedy import greedy
from slicer.sequence.method import Options, Progress
from slicer.sequence.problem import Problem
from slicer.sequence.routed import routed_sum


class Incumbent:
    """The cheapest sequence so far, from the given one or greedy's onwards.

    Attributes:
        oriented: int32 (n,), oriented toolpaths.
        cost: what it costs, mm or s.
        lower_bound: no sequence costs less.
    """

    def __init__(self, problem: Problem, options: Options) -> None:
        self._options = options
        self._segments = problem.segments
        self._objective = options.objective
        self.oriented = options.initial if options.initial is not None else greedy(problem, options).oriented
        self.cost = self.price(self.oriented)
        self.lower_bound = 0.0

    def price(self, oriented: NDArray[np.int32]) -> float:
        """What a sequence costs."""
        return sequence_cost(self._segments, self._objective, oriented)

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
            bound = self.lower_bound if bounded else None
            self._options.progress(Progress(stage, self.cost, bound))


def sequence_cost(segments: NDArray[np.float64], objective: Objective, oriented: NDArray[np.int32]) -> float:
    """What a printable sequence costs under an objective, mm or s."""
    if objective.routed:
        return routed_sum(segments, objective.parameters(), oriented)
    return direct_sum(segments, objective.parameters(), oriented)


@bare_kernel
def direct_sum(
    segments: NDArray[np.float64], parameters: NDArray[np.float64], oriented: NDArray[np.int32]
) -> float:
    """The cost of a sequence whose travels are all straight."""
    total = 0.0
    for k in range(1, len(oriented)):
        u, v = oriented[k - 1], oriented[k]
        dx = segments[v >> 1, v & 1, 0] - segments[u >> 1, 1 - (u & 1), 0]
        dy = segments[v >> 1, v & 1, 1] - segments[u >> 1, 1 - (u & 1), 1]
        total += direct_cost(parameters, dx, dy)
    return total
