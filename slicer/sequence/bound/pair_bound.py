"""The column-pair bound: a lower bound on the cost of every sequence, and an estimate that guides a search.

See ``states.blocks`` for the states, ``pair_costs`` for who pays what, ``pair_dp`` for what the blocks then
cost, and ``smoothed_ascent`` and ``subgradient_ascent`` for how the multipliers are found.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.detours import measure_detours, still_there
from slicer.sequence.bound.ends import Ends, find_ends
from slicer.sequence.bound.nearby import Climbed, nearby
from slicer.sequence.bound.paid import Paid
from slicer.sequence.bound.pair_costs import BlockCosts, apply_multipliers, block_costs
from slicer.sequence.bound.pair_dp import evaluate
from slicer.sequence.bound.reduced_cost_fixing import bound_through_states
from slicer.sequence.bound.smoothed_ascent import SmoothedAscent, never
from slicer.sequence.bound.smoothed_bound import SmoothedBound, nearest
from slicer.sequence.bound.subgradient_ascent import BEST, Ascent, ascend, begin_ascent
from slicer.sequence.bound.visits import by_start, charge_visits
from slicer.sequence.states import (
    COUNTED,
    Blocks,
    DownSets,
    Section,
    Skylines,
    connect,
    joint_states,
    never_follows,
    skylines,
)

RELATIVE_EPS = 1e-9
LEAST_COST = 1e-9
"""The ascent takes a sequence to cost this much at least,"""
LEAST_OF_MEAN = 0.01
"""and travels to the nearest toolpath this part of others, where they cost less or nothing."""
LOST = 0.1
"""The part of the gap by which all states may bring down a bound among some, before all are looked at."""


@dataclass(eq=False)
class PairBound:
    """The bound on one section, as far as its multipliers have been improved.

    Attributes:
        section, sets, blocks, block_costs, ends: what is bounded.
        best: float64, the multipliers of the best bound so far.
        bound: no sequence of the section's down-sets costs less; minus infinity before the first step.
        paid: what the blocks pay.
        value: float64, the least cost to the end of the block from each value of ``blocks``; that of
            ``best`` after ``use_best_multipliers`` alone, scratch while the bound rises.
        along_subgradients: whether it rises along those, see ``subgradient_ascent``; never over counts.
        pace: how many toolpaths neighbouring columns are apart at most in the states that the ascent looks
            at, see ``nearby``; infinite for all states. ``bound`` holds for all in any case.
    """

    section: Section
    sets: DownSets
    blocks: Blocks
    block_costs: BlockCosts
    ends: Ends
    best: NDArray[np.float64]
    bound: float = -np.inf
    paid: Paid = field(init=False)
    value: NDArray[np.float64] = field(init=False)
    along_subgradients: bool = False
    pace: float = np.inf
    _ascent: SmoothedAscent | None = None
    _smoothed: SmoothedBound | None = None
    _climbed: Climbed | None = None
    _steps: Ascent | None = None

    def __post_init__(self) -> None:
        self.paid = Paid(
            np.empty_like(self.block_costs.direct),
            np.empty_like(self.block_costs.ways),
            np.empty_like(self.block_costs.ways),
            np.empty_like(self.block_costs.ways),
            np.empty((4, self.blocks.down_sets)),
            np.empty_like(self.block_costs.price_at),
        )
        self.value = np.empty(self.blocks.value_start[-1])

    @classmethod
    def over(
        cls,
        section: Section,
        sets: DownSets,
        bounds: NDArray[np.int32],
        among: list[NDArray[np.bool_]] | None = None,
    ) -> "PairBound":
        """Set up the bound over blocks of columns, with the multipliers it begins with.

        Args:
            section: what is ordered.
            sets: its down-sets.
            bounds: the blocks, see ``blocks.cover``.
            among: the states that count, of those that a nozzle's body allows; None for all of these.
        """
        counted = sets.corridor == COUNTED
        # Which counts go together cannot be told, and all do.
        closed = None if counted.any() else joint_states(section, sets, bounds)
        if among is None or closed is None:
            among = closed if among is None else among
        else:
            among = [a & b for a, b in zip(among, closed, strict=True)]
        blocks = connect(section, sets, bounds, among)
        costs, multipliers = block_costs(section, blocks, visits=bool(counted.any()))
        for c in np.flatnonzero(counted):
            _forbid(section, blocks, costs, int(c))
        return cls(section, sets, blocks, costs, find_ends(section, sets, blocks), multipliers)

    def start_from(
        self, column: NDArray[np.int32], oriented: NDArray[np.intp], price: NDArray[np.float64]
    ) -> None:
        """Begin with prices that another bound has found, if its columns and these blocks allow.

        Args:
            column: int32 (n,), the columns that it has.
            oriented: int (2n,), which oriented toolpath each column of ``price`` is about.
            price: float64 (4, 2n), those of ``pair_costs``.
        """
        pairs = self.blocks.blocks == len(self.sets.size) - 1
        if pairs and np.array_equal(column, self.section.column):
            prices = slice(int(self.block_costs.pair_start[-1]), self.block_costs.visits)
            self.best[prices].reshape(4, -1)[:, oriented] = price

    @property
    def climbed(self) -> Climbed:
        """What the ascent looks at."""
        if self._climbed is None:
            self._climbed = whole = Climbed(self.blocks, self.block_costs, self.ends)
            if not self.along_subgradients:
                self._climbed = nearby(self.section, self.sets, whole, self.pace) or whole
        return self._climbed

    @cached_property
    def sky(self) -> Skylines:
        """The skylines that a search needs; the bound itself is on direct travels unless it sees walls."""
        return skylines(self.section, self.sets)

    def see_walls(self, most: float) -> None:
        """Price travels inside blocks as they are made over what is printed, where that can be known.

        A travel that costs more than ``most`` directly stays at that price: few of many are so long.
        """
        if self.section.routed and not (self.sets.corridor == COUNTED).any():
            start, detour = measure_detours(
                self.section, self.sets, self.blocks, self.block_costs, self.sky, most
            )
            self.block_costs = self.block_costs._replace(detour_start=start, detour=detour)
            self._let_go()

    def improve(self, target: float, steps: int, should_stop: Callable[[], bool] = never) -> bool:
        """Raise the bound towards ``target``, a cost that some sequence has; True when it cannot rise.

        Steps along subgradients are as short as a look at the bound, and do not ask whether to stop.
        """
        if self.along_subgradients:
            return self._follow_subgradients(target, steps)
        if self._ascent is None:
            self.bound = self._evaluate(self.best)
            mean = max(self.bound, 0.5 * target, LEAST_COST) / max(1, self.section.n)
            least = max(nearest(self.blocks, self.block_costs), LEAST_OF_MEAN * mean)
            self._ascent = SmoothedAscent(self.best, least, mean)
        if self.bound >= target or self.block_costs.size == 0:
            return True
        if self._smoothed is None:
            value = self.value
            if self.climbed.blocks is not self.blocks:
                value = np.empty(self.climbed.blocks.value_start[-1])
            self._smoothed = SmoothedBound(*self.climbed, self.paid, value)
        at_rest = self._ascent.climb(self._smoothed, target, steps, should_stop)
        bound = self._evaluate(self._ascent.multipliers)
        if bound > self.bound:
            self.bound, self.best = bound, self._ascent.multipliers
        if self.climbed.blocks is not self.blocks:
            nearby_bound = self._smoothed.evaluate(self._ascent.multipliers)
            if at_rest or nearby_bound - bound > LOST * (target - bound):
                self.pace, at_rest = np.inf, False
                self._let_go()
        return at_rest or self.bound >= target

    def _follow_subgradients(self, target: float, steps: int) -> bool:
        if self._steps is None:
            self._steps = begin_ascent(self.best)
        at_rest = ascend(
            self.blocks, self.block_costs, self.ends, self._steps, self.paid, self.value, target, steps
        )
        self.best, self.bound = self._steps.best, float(self._steps.memory[BEST])
        return at_rest

    def use_best_multipliers(self) -> None:
        """Fill ``paid`` and ``value`` from the best multipliers; the ascent may go on."""
        self._let_go()
        self.bound = self._evaluate(self.best)
        if self._steps is not None:  # along subgradients it goes on from here
            self._steps.multipliers[:] = self.best
            self._steps.memory[BEST] = self.bound

    def _let_go(self) -> None:
        """Drop the smoothed bound, which takes as much memory as all else and is of these blocks alone."""
        if self._ascent is not None:
            self._ascent.leave()
        self._smoothed = self._climbed = None

    def _evaluate(self, multipliers: NDArray[np.float64]) -> float:
        """The bound at some multipliers, with what is paid there and the values."""
        apply_multipliers(self.blocks, self.block_costs, multipliers, self.paid)
        charge_visits(self.blocks, self.block_costs, multipliers, self.paid)
        evaluate(self.blocks, self.block_costs, self.ends, self.paid, self.value)
        return float(self._by_start(multipliers).min())

    def _by_start(self, multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
        """The bound on all sequences that begin with each start, after ``evaluate``."""
        return by_start(self.blocks, self.block_costs, self.ends, multipliers, self.value)

    def fix_states(self, cut: float) -> None:
        """Leave out the states that no sequence below ``cut`` passes through.

        ``use_best_multipliers`` comes before. From then on the bound holds for the sequences below ``cut``
        alone.
        """
        by_start = self._by_start(self.best)
        least = bound_through_states(
            self.blocks, self.block_costs, self.ends, self.paid, self.value, by_start
        )
        # However close the cut is, the walks that give the bound itself must survive rounding.
        keep = least <= max(cut, self.bound + RELATIVE_EPS * abs(self.bound))
        keep[self.blocks.state_start[:-1]] = True
        among = []
        for k in range(self.blocks.blocks):
            mask = np.zeros(self.blocks.shape(k, self.sets), np.bool_)
            states = slice(self.blocks.state_start[k], self.blocks.state_start[k + 1])
            mask.flat[self.blocks.dense[states][keep[states]]] = True
            among.append(mask)
        before, self.blocks = self.blocks, connect(self.section, self.sets, self.blocks.bounds, among)
        start, detour = still_there(before, self.block_costs, self.blocks)
        self.block_costs = self.block_costs._replace(detour_start=start, detour=detour)
        self.ends = find_ends(self.section, self.sets, self.blocks)
        self.value = np.empty(self.blocks.value_start[-1])
        self._let_go()


def _forbid(section: Section, blocks: Blocks, costs: BlockCosts, c: int) -> None:
    """Make travels inside column c infinite that no sequence has, which walks through counts would take."""
    never = np.repeat(np.repeat(never_follows(section.part(section.column == c)), 2, axis=0), 2, axis=1)
    for k in range(blocks.home[c, 0], blocks.home[c, 1] + 1):
        low = 2 * int(blocks.column_size[blocks.bounds[k] : c].sum())
        stride = 2 * int(blocks.path_start[k + 1] - blocks.path_start[k])
        travels = costs.direct[costs.arc_start[k] : costs.arc_start[k + 1]].reshape(stride, stride)
        own = slice(low, low + len(never))
        travels[own, own][never] = np.inf
