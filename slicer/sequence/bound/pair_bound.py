"""The column-pair bound: a lower bound on the cost of every sequence, and an estimate that guides a search.

See ``states.blocks`` for the states, ``pair_costs`` for who pays what, ``pair_dp`` for what the blocks then
cost, and ``lagrangian_ascent`` for how the multipliers are found.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.detours import measure_detours, still_there
from slicer.sequence.bound.lagrangian_ascent import FIRST_STEP, Ascent, ascend
from slicer.sequence.bound.pair_costs import BlockCosts, Paid, apply_multipliers, block_costs
from slicer.sequence.bound.pair_dp import Ends, evaluate, roots
from slicer.sequence.bound.reduced_cost_fixing import bound_through_states
from slicer.sequence.bound.visits import charge_visits, settle_visits
from slicer.sequence.states import (
    COUNTED,
    NONE,
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


@dataclass(eq=False)
class PairBound:
    """The bound on one section, as far as its multipliers have been improved.

    Attributes:
        section, sets, blocks, block_costs, ends: what is bounded.
        multipliers: float64, where the ascent is.
        best: float64, the multipliers of the best bound so far.
        direction: float64, the ascent's moving average of subgradients.
        memory: float64 (3,), see ``ascend``.
        paid: what the blocks pay.
        value: float64, the least cost to the end of the block from each value of ``blocks``.
    """

    section: Section
    sets: DownSets
    blocks: Blocks
    block_costs: BlockCosts
    ends: Ends
    multipliers: NDArray[np.float64]
    best: NDArray[np.float64] = field(init=False)
    direction: NDArray[np.float64] = field(init=False)
    memory: NDArray[np.float64] = field(init=False)
    paid: Paid = field(init=False)
    value: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self.best = self.multipliers.copy()
        self.direction = np.zeros_like(self.multipliers)
        self.memory = np.array([FIRST_STEP, 0.0, -np.inf])
        self.paid = Paid(
            np.empty_like(self.block_costs.direct),
            np.empty_like(self.block_costs.ways),
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
        return cls(section, sets, blocks, costs, _ends(section, sets, blocks), multipliers)

    @cached_property
    def sky(self) -> Skylines:
        """The skylines that a search needs; the bound itself is on direct travels unless it sees walls."""
        return skylines(self.section, self.sets)

    @property
    def bound(self) -> float:
        """No sequence of the section's down-sets costs less; minus infinity before the first step."""
        return float(self.memory[2])

    def see_walls(self, most: float) -> None:
        """Price travels inside blocks as they are made over what is printed, where that can be known.

        A travel that costs more than ``most`` directly stays at that price: few of many are so long.
        """
        if self.section.routed and not (self.sets.corridor == COUNTED).any():
            start, detour = measure_detours(
                self.section, self.sets, self.blocks, self.block_costs, self.sky, most
            )
            self.block_costs = self.block_costs._replace(detour_start=start, detour=detour)

    def improve(self, target: float, iterations: int) -> bool:
        """Raise the bound towards ``target``, a cost that some sequence has; True when it cannot rise."""
        return ascend(
            self.blocks,
            self.block_costs,
            self.ends,
            Ascent(self.multipliers, self.best, self.direction, self.memory),
            self.paid,
            self.value,
            target,
            iterations,
        )

    def use_best_multipliers(self) -> None:
        """Fill ``arc``, ``ways`` and ``value`` from the best multipliers; the ascent may go on from there."""
        self.multipliers[:] = self.best
        apply_multipliers(self.blocks, self.block_costs, self.best, self.paid)
        charge_visits(self.blocks, self.block_costs, self.best, self.paid)
        evaluate(self.blocks, self.block_costs, self.ends, self.paid, self.value)
        self.memory[2] = self._by_start().min()

    def _by_start(self) -> NDArray[np.float64]:
        """The bound on all sequences that begin with each start, after ``evaluate``."""
        out = roots(self.blocks, self.ends, self.value)
        settle_visits(self.blocks, self.block_costs, self.ends, self.best, out)
        return out

    def fix_states(self, cut: float) -> None:
        """Leave out the states that no sequence below ``cut`` passes through.

        ``use_best_multipliers`` comes before. From then on the bound holds for the sequences below ``cut``
        alone.
        """
        by_start = self._by_start()
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
        self.ends = _ends(self.section, self.sets, self.blocks)
        self.value = np.empty(self.blocks.value_start[-1])


def _forbid(section: Section, blocks: Blocks, costs: BlockCosts, c: int) -> None:
    """Make travels inside column c infinite that no sequence has, which walks through counts would take."""
    never = np.repeat(np.repeat(never_follows(section.part(section.column == c)), 2, axis=0), 2, axis=1)
    for k in range(blocks.home[c, 0], blocks.home[c, 1] + 1):
        low = 2 * int(blocks.column_size[blocks.bounds[k] : c].sum())
        stride = 2 * int(blocks.path_start[k + 1] - blocks.path_start[k])
        travels = costs.direct[costs.arc_start[k] : costs.arc_start[k + 1]].reshape(stride, stride)
        own = slice(low, low + len(never))
        travels[own, own][never] = np.inf


def _ends(section: Section, sets: DownSets, blocks: Blocks) -> Ends:
    """Find the values of all starts, and the last toolpath in the numbers of its blocks."""
    starts, values = [], []
    for u in section.starts:
        home = blocks.home[section.column[u >> 1]]
        at = [_first_step(section, sets, blocks, int(k), int(u) >> 1) for k in home]
        if NONE not in at:
            starts.append(u)
            values.append([blocks.move_value[e] + (u & 1) for e in at])
    last_home = np.full(2, NONE, np.int32)
    last_local = np.full(2, NONE, np.int32)
    if section.last != NONE:
        s = section.last >> 1
        last_home[:] = blocks.home[section.column[s]]
        for end in range(2):
            last_local[end] = 2 * _local(section, sets, blocks, int(last_home[end]), s) + (section.last & 1)
    return Ends(
        np.array(starts, np.int32),
        np.array(values, np.int32),
        blocks.home[section.column[np.array(starts, np.int32) >> 1]],
        last_home,
        last_local,
    )


def _first_step(section: Section, sets: DownSets, blocks: Blocks, k: int, s: int) -> int:
    """The step of block k from nothing to toolpath s, or ``NONE``."""
    empty = blocks.state_start[k]
    begin, end = blocks.move_start[empty], blocks.move_start[empty + 1]
    at = np.flatnonzero(blocks.move_path[begin:end] == _local(section, sets, blocks, k, s))
    return int(begin + at[0]) if len(at) else NONE


def _local(section: Section, sets: DownSets, blocks: Blocks, k: int, s: int) -> int:
    """The number of toolpath s in block k."""
    return int(sets.local[s] + sets.size[blocks.bounds[k] : section.column[s]].sum())
