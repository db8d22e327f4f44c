"""The contract between ``solve`` and the methods: what a method is given, and what it hands back."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem.checks import whole_number
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.problem import Problem

EFFORTS = ("quick", "default", "high")
"""Budgets of iterations, which scale with the number of toolpaths."""


@dataclass(frozen=True)
class Progress:
    """A word from a running method.

    Attributes:
        stage: what has just been done.
        cost: what the best sequence so far costs by the objective, mm or s.
        lower_bound: no sequence costs less, in the same unit; None where nothing is known.
        oriented: int32 (n,), that sequence as oriented toolpaths; not to be changed.
    """

    stage: str
    cost: float
    lower_bound: float | None
    oriented: NDArray[np.int32] | None = None


@dataclass(frozen=True, eq=False)
class Options:
    """How long and from where a method searches.

    Attributes:
        effort: "quick", "default" or "high": budgets of iterations, which make no use of the clock.
        seed: for methods that draw random numbers.
        objective: what the sequence is optimised for.
        deadline: ``time.perf_counter()`` value at which a method stops early; None for no limit.
        initial: int32 (n,), oriented toolpaths; a printable sequence that a method may improve on.
        progress: called now and then, never from a compiled kernel.

    Raises:
        SequenceError: the seed is no whole number, or negative.
    """

    effort: str = "default"
    seed: int = 0
    objective: Objective = field(default_factory=Objective)
    deadline: float | None = None
    initial: NDArray[np.int32] | None = None
    progress: Callable[[Progress], None] | None = None

    def __post_init__(self) -> None:
        seed = whole_number("seed", self.seed, "Give 0 or any larger one.", 0)
        object.__setattr__(self, "seed", seed)  # numbers of numpy overflow where seeds are added to

    def out_of_time(self) -> bool:
        """Whether the deadline has passed."""
        return self.deadline is not None and time.perf_counter() >= self.deadline

    def starting_from(self, oriented: NDArray[np.int32]) -> "Options":
        """The same options with another ``initial``."""
        return replace(self, initial=oriented)


@dataclass(frozen=True, eq=False)
class Found:
    """What a method hands back to ``solve``.

    Attributes:
        oriented: int32 (n,), the sequence of oriented toolpaths.
        nodes_visited, states_created: see ``Result``.
        lower_bound_mm: a proven lower bound on straight travel, or None.
        stopped: whether the deadline or Ctrl-C ended it before its effort was spent.
        proved: whether no sequence costs less by the objective.
    """

    oriented: NDArray[np.int32]
    nodes_visited: int = 0
    states_created: int = 0
    lower_bound_mm: float | None = None
    stopped: bool = False
    proved: bool = False


Method = Callable[[Problem, Options], Found]
