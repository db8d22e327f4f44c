"""One search: what is asked, what may still be spent, the best sequence and bound so far, and who is told.

This is all that a method is given, and all that it hands back.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem.checks import whole_number
from slicer.sequence.problem.neighbour_lists import Neighbours, neighbours
from slicer.sequence.problem.objective import Objective, ObjectiveName
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.random_numbers import Draws, random_state
from slicer.sequence.problem.result import RELATIVE_EPS
from slicer.sequence.problem.sequence_cost import true_cost

EFFORTS = ("quick", "default", "high")
"""Budgets of iterations, which scale with the number of toolpaths."""


WORTH = {"quick": 0.02, "default": 0.01, "high": 0.0}
"""Part of the cost that the next stage of a search must be able to save, or it is not begun."""

LIKELY = 0.5
"""Part of what the bound leaves to gain that a stage may be expected to gain: on examples and random walks no
stage behind the proof of "time" gained more."""


@dataclass(frozen=True)
class Progress:
    """A word from a running search.

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
class Outcome:
    """What a search has come to, as one process tells another.

    Attributes:
        objective: what it was for.
        oriented: int32 (n,), the cheapest sequence of oriented toolpaths; None where there is none yet.
        lower_bound: see ``Search``.
        straight_bound_mm: see ``Search``.
        nodes_visited, states_created: see ``Result``.
        stopped: see ``Search``.
    """

    objective: Objective
    oriented: NDArray[np.int32] | None
    lower_bound: float
    straight_bound_mm: float
    nodes_visited: int
    states_created: int
    stopped: bool


class Search:
    """A search for the cheapest sequence of a problem.

    Attributes:
        problem: what is ordered.
        objective: what counts.
        effort: "quick", "default" or "high": budgets of iterations, which make no use of the clock.
        seed: of all random numbers, see ``random_state``.
        initial: int32 (n,), the printable sequence of oriented toolpaths that it was given; or None.
        deadline: ``time.perf_counter()`` value at which it should stop; None for no limit.
        listener: called with ``Progress`` by ``report``; None where nobody listens.
        cost: what the best sequence costs, in the objective's unit; infinity where there is none.
        lower_bound: no sequence costs less, in the same unit; 0 where nothing is known.
        straight_bound_mm: no sequence has a straight travel J below this, whatever the objective is.
        nodes_visited, states_created: see ``Result``; methods add to them.
        stopped: whether the deadline or Ctrl-C ended something before its effort was spent.

    Raises:
        SequenceError: the seed is no whole number, or negative.
    """

    def __init__(
        self,
        problem: Problem,
        *,
        objective: Objective | None = None,
        effort: str = "default",
        seed: int = 0,
        deadline: float | None = None,
        initial: NDArray[np.int32] | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        self.problem = problem
        self.objective = Objective() if objective is None else objective
        self.effort = effort
        # Numbers of numpy overflow where seeds are added to.
        self.seed = whole_number("seed", seed, "Give 0 or any larger one.", 0)
        self.initial = initial
        self.deadline = deadline
        self.listener = progress
        self._goal: Search | None = None
        self._near: Neighbours | None = None
        self._best: NDArray[np.int32] | None = None
        self.cost = np.inf
        self.lower_bound = self.straight_bound_mm = 0.0
        self.nodes_visited = self.states_created = 0
        self.stopped = False
        self.offer(initial)

    # --- the best so far

    @property
    def started(self) -> bool:
        """Whether there is a sequence yet."""
        return self._best is not None

    @property
    def oriented(self) -> NDArray[np.int32]:
        """int32 (n,), the cheapest sequence so far; not to be changed."""
        if self._best is None:
            raise AssertionError("the search has no sequence yet")
        return self._best

    def offer(self, oriented: NDArray[np.int32] | None) -> bool:
        """Take a sequence of oriented toolpaths (n,) if it is cheaper than the best so far."""
        if oriented is None:
            return False
        cost = true_cost(self.problem, self.objective, oriented)
        if self._best is not None and cost >= self.cost:
            return False
        self._best, self.cost = oriented, cost
        return True

    def raise_bound(self, bound: float) -> None:
        """Take a lower bound on all sequences, or on all that are cheaper than the best so far."""
        self.lower_bound = max(self.lower_bound, min(bound, self.cost))
        if not self.objective.routed:
            self.straight_bound_mm = self.lower_bound

    def raise_bound_on_all(self, bound: float) -> None:
        """Take a lower bound on all sequences, the best so far included.

        Raises:
            AssertionError: it is above that one, and so is no bound.
        """
        if bound > self.cost * (1 + RELATIVE_EPS):
            raise AssertionError(f"a bound of {bound} is above a sequence of {self.cost}")
        self.raise_bound(bound)

    @property
    def proved(self) -> bool:
        """Whether nothing is cheaper than the best so far."""
        return self.started and self.lower_bound >= self.cost

    @property
    def near_enough(self) -> bool:
        """Whether the bound proves that no further stage can gain more than ``WORTH`` of the cost allows."""
        return self.started and self.lower_bound >= (1.0 - WORTH[self.effort]) * self.cost

    def pays(self, seconds: float) -> bool:
        """Whether a stage may gain more seconds of printing than it takes seconds of work.

        Where the cost is no time, nothing is known of what can be gained, or for papers, it always may.

        Args:
            seconds: of work, from counts and never from the clock, so that results are the same everywhere.
        """
        if self.effort == "high" or not self.objective.timed or self.lower_bound == 0.0:
            return True
        return LIKELY * (self.cost - self.lower_bound) >= seconds

    def won_back(self, gained: float, seconds: float) -> bool:
        """Whether work that took so many seconds has gained as many of printing; see ``pays``."""
        return self.effort == "high" or not self.objective.timed or gained >= seconds

    @property
    def serves_another(self) -> bool:
        """Whether another search made it, for sequences that may be good ones there; see ``surrogate``."""
        return self._goal is not None

    # --- what may be spent, and chance

    def should_stop(self) -> bool:
        """Whether the deadline has passed; every loop that lasts asks between two steps.

        Ctrl-C needs no asking: methods let ``KeyboardInterrupt`` through, and what they have offered stays.
        """
        late = self.late()
        self.stopped = self.stopped or (late and not self.proved)
        return late

    def late(self) -> bool:
        """Whether the deadline has passed."""
        left = self.time_left()
        return left is not None and left <= 0.0

    def time_left(self) -> float | None:
        """Seconds until the deadline, below 0 behind it; None where there is none."""
        return None if self.deadline is None else self.deadline - time.perf_counter()

    def random_state(self, draws: Draws, stream: int | None = None) -> NDArray[np.uint64]:
        """uint64 (1,), for ``draw``; ``stream`` tells apart several runs of the same kind."""
        return random_state(self.seed, draws, stream)

    def near(self) -> Neighbours:
        """The neighbours of each toolpath's ends, found once."""
        if self._near is None:
            self._near = neighbours(self.problem, self.objective)
        return self._near

    # --- who is told, and searches within a search

    def report(self, stage: str) -> None:
        """Say how things stand, if anyone listens; never from a compiled kernel."""
        if self._goal is not None:
            self._goal.absorb(self.outcome(counted=False))
            self._goal.report(stage)
        elif self.listener is not None:
            known = self.lower_bound if self.lower_bound > 0.0 or self.proved else None
            self.listener(Progress(stage, self.cost, known, self._best))

    def surrogate(
        self, name: ObjectiveName, *, share: float = 1.0, effort: str | None = None, upwards: float = 1.0
    ) -> "Search":
        """A search for another objective from the same initial sequence, whose finds are offered to this one.

        It may take ``share`` of the time that is left, and another ``effort``, and see the sheet stretched
        ``upwards`` so many times. Its counts are those of ``absorb``, to be called in the end.
        """
        deadline, left = self.deadline, self.time_left()
        if deadline is not None and left is not None and share < 1.0:
            deadline -= (1.0 - share) * left
        inner = Search(
            self.problem if upwards == 1.0 else self.problem.stretched(upwards),
            objective=replace(self.objective, name=name),
            effort=effort or self.effort,
            seed=self.seed,
            deadline=deadline,
            initial=self.initial,
        )
        inner._goal = self
        return inner

    def part(self, problem: Problem) -> "Search":
        """A search for the same of another problem, such as a part of this one, that nobody listens to."""
        return Search(
            problem, objective=self.objective, effort=self.effort, seed=self.seed, deadline=self.deadline
        )

    def apart(self, seed: int) -> "Search":
        """A search of its own for the same, without deadline and listener, which another process may get."""
        return Search(
            self.problem, objective=self.objective, effort=self.effort, seed=seed, initial=self.initial
        )

    def outcome(self, *, counted: bool = True) -> Outcome:
        """What this search has come to so far; without its counts where more will come."""
        # What bounds a stretched sheet bounds nothing here.
        bounds = self._goal is None or self._goal.problem is self.problem
        return Outcome(
            self.objective,
            self._best,
            self.lower_bound if bounds else 0.0,
            self.straight_bound_mm if bounds else 0.0,
            self.nodes_visited if counted else 0,
            self.states_created if counted else 0,
            self.stopped if counted else False,
        )

    def absorb(self, other: Outcome) -> None:
        """Take in what another search on the same problem has found, whatever its objective was."""
        if other.oriented is not self._best:
            self.offer(other.oriented)
        if other.objective.relaxes(self.objective):
            self.raise_bound(other.lower_bound)
        self.straight_bound_mm = max(self.straight_bound_mm, other.straight_bound_mm)
        self.nodes_visited += other.nodes_visited
        self.states_created += other.states_created
        self.stopped = self.stopped or other.stopped


Method = Callable[[Search], None]
"""A way to search: it starts from the best so far, or from a sequence of its own where there is none, offers
what it finds, raises the bound where it can prove one, reports between its steps and asks
``should_stop`` there. When it returns, the search has a sequence.
"""
