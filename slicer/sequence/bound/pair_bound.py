"""The column-pair bound: a lower bound on the cost of every sequence, and an estimate that guides a search.

See ``states.blocks`` for the states, ``pair_costs`` for who pays what, ``pair_dp`` for what the blocks then
cost, and ``subgradient_ascent`` for how the multipliers are found.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.detours import Measured, measure_detours, raise_over_certain, still_there
from slicer.sequence.bound.ends import Ends, find_ends
from slicer.sequence.bound.lagrangian_costs import room_to_pay
from slicer.sequence.bound.nearby import LOST, PACE, Climbed, Nearby, near_states
from slicer.sequence.bound.paid import Paid
from slicer.sequence.bound.pair_costs import BlockCosts, block_costs
from slicer.sequence.bound.reduced_cost_fixing import bound_through_states
from slicer.sequence.bound.subgradient_ascent import Ascent, begin_ascent, bound_at
from slicer.sequence.states import (
    COUNTED,
    OUTSIDE,
    Blocks,
    DownSets,
    Section,
    Skylines,
    comes_before,
    connect,
    joint_states,
    never_follows,
    skylines,
)

RELATIVE_EPS = 1e-9
LEAST_COST = 1e-9
"""The ascent takes a sequence to cost this much at least."""
LONG = 3.5
"""A travel that costs so many times the mean is long: good sequences hardly have any.

Up to 5 times the mean it takes three times as long to price them, on muscle_us_8x8 under a brass nozzle
3.3 s, and bounds rise by 0.1 % at most.
"""
HARDLY_FEWER = 0.9
"""With more of all travels left, states that could be left out stay."""
LOSES = 0.05
"""A block that has this part of what all lose by that is among those where more are looked at."""


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
        by_start: float64, the bound on the sequences from each start, by ``use_best_multipliers``.
        pace: how many toolpaths neighbouring columns are apart at most in the states that the ascent looks
            at, see ``nearby``, of all blocks or of each; infinite for all states. ``bound`` holds for all in
            any case.
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
    by_start: NDArray[np.float64] = field(init=False)
    pace: float | NDArray[np.float64] = np.inf
    _ascent: Ascent | None = None
    _looked_at: Nearby | None = None

    def __post_init__(self) -> None:
        self.paid = room_to_pay(self.blocks, self.block_costs)
        self.value = np.empty(self.blocks.value_start[-1])

    @classmethod
    def over(
        cls,
        section: Section,
        sets: DownSets,
        bounds: NDArray[np.int32],
        among: list[NDArray[np.bool_]] | None = None,
        never: NDArray[np.bool_] | None = None,
    ) -> "PairBound":
        """Set up the bound over blocks of columns, with the multipliers it begins with.

        Args:
            section: what is ordered.
            sets: its down-sets.
            bounds: the blocks, see ``blocks.cover``; of no more than two columns where states are counts.
            among: the states that count, of those that a nozzle's body allows; None for all of these. Which
                counts it allows has to be told here.
            never: bool (n, n), by ``never_follows``, where states are counts and columns are tied. If None,
                counts know what may follow within a column alone.
        """
        counted = sets.corridor == COUNTED
        if counted.any() and np.diff(bounds).max() > 1:
            raise ValueError("blocks of states that are counts have two columns at most")
        closed = None if counted.any() else joint_states(section, sets, bounds)
        if among is None or closed is None:
            among = closed if among is None else among
        else:
            among = [a & b for a, b in zip(among, closed, strict=True)]
        blocks = connect(section, sets, bounds, among)
        costs, multipliers = block_costs(section, blocks, visits=bool(counted.any()))
        if counted.any():
            _forbid(section, blocks, costs, counted, never)
        raise_over_certain(section, blocks, costs)
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

    def go_on_from(self, coarser: "PairBound") -> None:
        """Begin with the multipliers of a bound over the same blocks whose states are others.

        All but the prices of down-sets in between, which are about those states.
        """
        assert np.array_equal(self.blocks.path, coarser.blocks.path)
        own, theirs = self.block_costs, coarser.block_costs
        self.best[: own.visits] = coarser.best[: theirs.visits]
        if own.visits_end - own.visits == theirs.visits_end - theirs.visits:  # none where there are no counts
            self.best[own.visits : own.visits_end] = coarser.best[theirs.visits : theirs.visits_end]
        jumps = slice(theirs.visits_end, theirs.jumps.passing)
        self.best[own.visits_end : own.jumps.passing] = coarser.best[jumps]

    @property
    def looked_at(self) -> Nearby:
        """What the ascent looks at."""
        if self._looked_at is None:
            whole = Climbed(self.blocks, self.block_costs, self.ends)
            self._looked_at = Nearby.among(self.section, self.sets, whole, self.value, self.pace)
        return self._looked_at

    @cached_property
    def sky(self) -> Skylines:
        """The skylines that a search needs; the bound itself is on direct travels unless it sees walls."""
        return skylines(self.section, self.sets)

    def see_walls(self, cost: float) -> None:
        """Price travels inside blocks as they are made over what is printed, where that can be known.

        Long travels stay at their direct price, since a sequence that costs no more than ``cost`` hardly has
        any, and those of states of columns that are farther apart than ``PACE``: few walks pass there.
        """
        if self.section.routed and not (self.sets.corridor == COUNTED).any():
            near = near_states(self.section, self.sets, self.blocks, PACE)
            start, detour = measure_detours(
                self.section,
                self.sets,
                self.blocks,
                self.block_costs,
                self.sky,
                Measured(near, LONG * cost / self.section.n),
            )
            self.block_costs = self.block_costs._replace(detour_start=start, detour=detour)
            self._looked_at = None

    def arcs_of(self, steps: int) -> int:
        """How many travels ``improve`` looks at in so many steps."""
        near = self.looked_at.near.blocks
        return steps * self.looked_at.arcs + (self.blocks.arcs if near is not self.blocks else 0)

    def gap(self, cost: float) -> float:
        """The part of a cost that the bound is below it; 1 where that is more, or nothing is known."""
        return float(np.clip((cost - self.bound) / cost, 0.0, 1.0)) if cost > 0.0 else 1.0

    def improve(self, target: float, lengths: NDArray[np.float64]) -> bool:
        """Raise the bound by steps of these lengths, see ``step_lengths``; True when it cannot rise above.

        Args:
            target: a cost that some sequence has.
            lengths: float64 (k,), as parts of that. Between two steps it is not asked whether to stop.
        """
        if self._ascent is None:
            self._ascent = begin_ascent(self.best)
        far = max(0.0, -self.bound) if np.isfinite(self.bound) else 0.0  # from where it should be at least
        scaled = (max(target, LEAST_COST) + far) * lengths
        at_rest, found = self.looked_at.climb(self._ascent, self.paid, scaled, target)
        whole = self.looked_at.near.blocks is self.blocks
        bound = found if whole else float(self._evaluate(self._ascent.best).min())
        if bound > self.bound:
            self.bound, self.best = bound, self._ascent.best.copy()
        if not whole and (at_rest or found - bound > LOST * (target - bound)):
            self._widen(self._ascent.best)
            # It goes on from where it is: what its multipliers overlook are those states alone.
            self._ascent.bound[0] = -np.inf
            return self.bound >= target
        return at_rest or self.bound >= target

    def _widen(self, multipliers: NDArray[np.float64]) -> None:
        """Let the ascent look at states of columns that are farther apart, in the blocks that pass there.

        Args:
            multipliers: where the values of all states are known.
        """
        blocks, costs, ends = self.looked_at.near
        value = self.looked_at.value
        bound_at(blocks, costs, ends, multipliers, self.paid, value)
        lost = np.zeros(blocks.blocks)
        for side in range(OUTSIDE):
            near = value[blocks.value_start[blocks.state_start[:-1]] + side]
            far = self.value[self.blocks.value_start[self.blocks.state_start[:-1]] + side]
            lost = np.maximum(lost, np.subtract(near, far, out=np.zeros_like(near), where=np.isfinite(far)))
        wider = lost > LOSES * lost.sum()
        self.pace = np.where(wider | ~wider.any(), 2.0, 1.0) * self.pace
        self._looked_at = None

    def _go_on(self) -> None:
        """Let the ascent begin anew at the best multipliers."""
        if self._ascent is not None:
            self._ascent.multipliers[:] = self._ascent.best[:] = self.best
            self._ascent.bound[0] = -np.inf

    def use_best_multipliers(self) -> None:
        """Fill ``paid`` and ``value`` from the best multipliers; the ascent may go on, from these."""
        self.by_start = self._evaluate(self.best)
        self.bound = float(self.by_start.min())
        self._go_on()

    def _evaluate(self, multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
        """The bound by start at some multipliers, with what is paid there and the values."""
        return bound_at(self.blocks, self.block_costs, self.ends, multipliers, self.paid, self.value)

    def fix_states(self, cut: float) -> None:
        """Leave out the states that no sequence below ``cut`` passes through.

        ``use_best_multipliers`` comes before. From then on the bound holds for the sequences below ``cut``
        alone. Where these are hardly any, all stay: their graph takes as long to make as some steps.
        """
        least = bound_through_states(
            self.blocks, self.block_costs, self.ends, self.paid, self.value, self.by_start
        )
        # However close the cut is, the walks that give the bound itself must survive rounding.
        keep = least <= max(cut, self.bound + RELATIVE_EPS * abs(self.bound))
        keep[self.blocks.state_start[:-1]] = True
        if self.blocks.arcs_at[keep].sum() > HARDLY_FEWER * self.blocks.arcs:
            return
        among = self.blocks.among(keep, self.sets)
        before, self.blocks = self.blocks, connect(self.section, self.sets, self.blocks.bounds, among)
        start, detour = still_there(before, self.block_costs, self.blocks)
        self.block_costs = self.block_costs._replace(detour_start=start, detour=detour)
        self.ends = find_ends(self.section, self.sets, self.blocks)
        self.value = np.empty(self.blocks.value_start[-1])
        self._looked_at = None


def _forbid(
    section: Section,
    blocks: Blocks,
    costs: BlockCosts,
    counted: NDArray[np.bool_],
    never: NDArray[np.bool_] | None,
) -> None:
    """Make travels inside blocks infinite that no sequence has, which walks through counts would take."""
    if never is not None:
        for k in range(blocks.blocks):
            own = blocks.path[blocks.path_start[k] : blocks.path_start[k + 1]]
            _bar(blocks, costs, k, 0, never[np.ix_(own, own)])
        return
    for c in np.flatnonzero(counted):
        part = section.part(section.column == c)
        inner = never_follows(part, comes_before(part))
        for k in range(blocks.home[c, 0], blocks.home[c, 1] + 1):
            _bar(blocks, costs, k, int(blocks.column_size[blocks.bounds[k] : c].sum()), inner)


def _bar(blocks: Blocks, costs: BlockCosts, k: int, low: int, never: NDArray[np.bool_]) -> None:
    """Make travels of block k infinite, of its toolpaths from ``low`` on; ``never`` is bool (m, m)."""
    stride = 2 * int(blocks.path_start[k + 1] - blocks.path_start[k])
    travels = costs.direct[costs.arc_start[k] : costs.arc_start[k + 1]].reshape(stride, stride)
    own = slice(2 * low, 2 * (low + len(never)))
    travels[own, own][np.repeat(np.repeat(never, 2, axis=0), 2, axis=1)] = np.inf
