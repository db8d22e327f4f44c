"""The sheets of docs/how-it-works.md: the small one of its pictures, and measured tissue."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slicer.generate import random_walk
from slicer.grid import Grid, read
from slicer.hatch import Hatch, hatch
from slicer.sequence import Problem, Result, solve
from slicer.sequence.bound import PairBound, step_lengths
from slicer.sequence.bound.reduced_cost_fixing import bound_through_states
from slicer.sequence.bound.streamed_ascent import MOST_DOWN_SETS
from slicer.sequence.construct import start_along_levels
from slicer.sequence.layered.layered_search import LayeredSearch, search_layers
from slicer.sequence.problem import Objective, Progress, Search
from slicer.sequence.states import DownSets, Section, all_down_sets, cover
from vslice.printable import problem_of

ROOT = Path(__file__).parents[1]
REAL = ROOT / "tests" / "data" / "tissue" / "muscle_us_8x8.json"
STEPS = (0, 20, 40)
"""After so many steps of its ascent the bound is shown."""
LONG_MM = 0.5
"""Travels above this are long ones."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A sheet with all that the page says of it; straight travel, from the bottom left corner."""

    grid: Grid

    @cached_property
    def lines(self) -> Hatch:
        """Its toolpaths."""
        return hatch(self.grid)

    @cached_property
    def problem(self) -> Problem:
        """What is to be ordered, as ``vslice compare`` asks it."""
        return problem_of(self.lines.segments, "corner")

    @cached_property
    def greedy(self) -> Result:
        """The nearest printable toolpath, again and again."""
        return solve(self.problem, method="greedy")

    @cached_property
    def searched(self) -> tuple[Result, list[Progress]]:
        """What the default search returns, and what it reports on the way."""
        told: list[Progress] = []
        return solve(self.problem, progress=told.append), told

    @property
    def best(self) -> Result:
        """What the default search returns."""
        return self.searched[0]

    @cached_property
    def along_levels(self) -> Search:
        """A search that holds the sequence which the default search begins with."""
        search = Search(self.problem)
        start_along_levels(search)
        return search

    @cached_property
    def section(self) -> Section:
        """The whole problem, as the states see it."""
        return Section.whole(self.problem, Objective())

    @cached_property
    def sets(self) -> DownSets:
        """The down-sets of its columns."""
        sets = all_down_sets(self.section, MOST_DOWN_SETS)
        assert sets is not None
        return sets

    def pairs(self, most_states: int = 0) -> PairBound:
        """The bound over pairs of columns, or over more where those have few states."""
        return PairBound.over(self.section, self.sets, cover(self.sets, most_states))

    def travels(self, result: Result) -> NDArray[np.float64]:
        """float64 (n - 1, 2, 2), from the end of each toolpath to the start of the next."""
        path = self.lines.segments[result.order]
        flip = result.flipped.astype(np.intp)
        k = np.arange(len(path))
        return np.stack([path[k, 1 - flip][:-1], path[k, flip][1:]], axis=1)

    def orders(self) -> int:
        """In how many orders the toolpaths can be printed, the first one given."""
        total, length = 1, 0
        for c, size in enumerate(self.sets.size.tolist()):
            total *= _ways(self.sets, c)
            # The first toolpath stays in front: only the rest of its column is shuffled in.
            for k in range(1, size + 1 - int(c == self.problem.column[self.section.first])):
                length += 1
                total = total * length // k
        return total


def _ways(sets: DownSets, c: int) -> int:
    """In how many orders the toolpaths of a column can be printed."""
    begin, end = int(sets.start[c]), int(sets.start[c + 1])
    ways = [1] + [0] * (end - begin - 1)
    for i in range(begin, end):
        for e in range(int(sets.step_start[i]), int(sets.step_start[i + 1])):
            ways[int(sets.step_to[e]) - begin] += ways[i - begin]
    return ways[-1]


@dataclass(frozen=True, eq=False)
class Fixing:
    """The bound over pairs on a small sheet, before and after its states are fixed.

    Attributes:
        without: the bound with no multipliers at all.
        rising: the bound after each of ``STEPS``.
        before, after: the states of each pair of columns.
        cut: the cost of the sequence that the bound was held against.
        through: float64 (i, j), the bound through each state of the first pair; NaN where there is none.
        found: the layered search in what is left.
    """

    without: float
    rising: list[float]
    before: list[int]
    after: list[int]
    cut: float
    through: NDArray[np.float64]
    found: LayeredSearch

    @property
    def worst(self) -> tuple[int, int]:
        """The state of the first pair through which the bound is highest."""
        through = np.where(np.isfinite(self.through), self.through, 0.0)
        i, j = np.unravel_index(through.argmax(), through.shape)
        return int(i), int(j)


def fix(sheet: Sheet) -> Fixing:
    """Raise the bound over pairs of columns, strike out states, and search the rest."""
    search = sheet.along_levels
    bound = sheet.pairs()
    start = bound.best.copy()
    bound.best[:] = 0.0
    bound.use_best_multipliers()
    without = bound.bound
    bound.best[:] = start
    bound.use_best_multipliers()
    rising = [bound.bound]
    lengths = step_lengths(STEPS[-1])
    for before, after in pairwise(STEPS):
        bound.improve(search.cost, lengths[before:after])
        rising.append(bound.bound)
    bound.use_best_multipliers()
    states = states_of(bound)
    least = bound_through_states(
        bound.blocks, bound.block_costs, bound.ends, bound.paid, bound.value, bound.by_start
    )
    through = np.full(bound.blocks.shape(0, bound.sets), np.nan)
    of_first = slice(bound.blocks.state_start[0], bound.blocks.state_start[1])
    through.flat[bound.blocks.dense[of_first]] = least[of_first]
    bound.fix_states(search.cost)
    bound.use_best_multipliers()
    left = states_of(bound)
    found = search_layers(search, bound, search.cost, 10**6)
    return Fixing(without, rising, states, left, search.cost, through, found)


def small() -> Sheet:
    """The sheet of the pictures."""
    return Sheet(random_walk(3, 3, seed=1, spacing_mm=0.2))


def real() -> Sheet:
    """Measured tissue."""
    return Sheet(read(REAL))


def states_of(bound: PairBound) -> list[int]:
    """The states of each block."""
    return [int(states) for states in np.diff(bound.blocks.state_start)]
