"""The states that an ascent looks at where it need not look at all.

Good sequences keep neighbouring columns at about the same pace, and so do the cheap walks of a bound: states
of columns that are about equally done are *near*. The cheapest walks pass through few of these, and for many
steps they stay among those through which walks are hardly dearer. Prices rise among such states as they would
among all, in a fraction of the time.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.sequence.bound.detours import still_there
from slicer.sequence.bound.ends import Ends, find_ends
from slicer.sequence.bound.paid import Paid
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.bound.reduced_cost_fixing import bound_through_states
from slicer.sequence.bound.subgradient_ascent import Ascent, ascend, bound_at
from slicer.sequence.states import COUNTED, Blocks, DownSets, Section, connect, set_sizes

PACE = 28.0
"""How many toolpaths, on average, a column may be ahead of its neighbour."""
FEWER = 0.8
"""With more of all travels left, looks at all states in between cost more than is saved."""
MANY = 1_500_000
"""With more travels than these among near states, an ascent chooses some."""
REACH = 1.5
"""It looks at states through which walks cost so many mean travels more than the cheapest at most,"""
LEAST_SHARE = 0.1
"""or a multiple of it, until these states have so large a part of all travels.

Bounds over all near states then are the same to five digits. Either alone leads astray: 0.15 of all travels
were enough on 10x10 and on 20x20, and too few where columns have few states (ihc_8x8).
"""
STRIDE = 0.6
"""It goes so far, in parts of the cost, before it looks at all near states again."""
LEAST_STEPS = 10
"""Fewer steps than these are taken among all near states."""
LOST = 0.05
"""The part of the gap by which more states may bring down a bound among some, before more are looked at."""
DRIFTED, ASTRAY = 0.1, 4.0
"""Where all near states bring the bound down by the first part of the reach, others are chosen, where walks
are cheapest now; where they do so by the second, the reach doubles as well, and the ascent goes back."""
LIKELY_SHARE = 0.25
"""A step among chosen states, with the looks in between, takes such a part of one among all near states."""


class Climbed(NamedTuple):
    """What an ascent looks at: states, what they pay, and where walks through them begin and end."""

    blocks: Blocks
    block_costs: BlockCosts
    ends: Ends


def near_states(section: Section, sets: DownSets, blocks: Blocks, pace: ArrayLike) -> NDArray[np.bool_]:
    """bool (s,), the states whose neighbouring columns are at most ``pace`` toolpaths apart, on average.

    Args:
        pace: float, or (b,) for each block.
    """
    slack = np.broadcast_to(np.asarray(pace) * section.columns / section.n, blocks.blocks)
    if (slack >= 1.0).all():
        return np.ones(len(blocks.dense), np.bool_)
    done = [size / size[-1] for size in set_sizes(sets)]
    out = np.empty(len(blocks.dense), np.bool_)
    for k in range(blocks.blocks):
        states = slice(blocks.state_start[k], blocks.state_start[k + 1])
        columns = range(int(blocks.bounds[k]), int(blocks.bounds[k + 1]) + 1)
        at = np.unravel_index(blocks.dense[states], blocks.shape(k, sets))
        shares = np.array([done[c][i] for c, i in zip(columns, at, strict=True)])
        out[states] = (np.abs(np.diff(shares, axis=0)) <= slack[k]).all(axis=0)
    return out


def climbed_among(
    section: Section, sets: DownSets, whole: Climbed, chosen: NDArray[np.bool_]
) -> Climbed | None:
    """Those of ``whole`` that are ``chosen``, bool (s,); None if hardly fewer, or where no walk can."""
    blocks = whole.blocks
    # Of the travels that chosen states have, hardly any leads to one that is not.
    if blocks.arcs_at[chosen].sum() > FEWER * blocks.arcs:
        return None
    inner = connect(section, sets, blocks.bounds, blocks.among(chosen, sets))
    if (np.diff(inner.state_start) == 0).any():
        return None
    ends = find_ends(section, sets, inner)
    if len(ends.starts) == 0:
        return None
    start, detour = still_there(blocks, whole.block_costs, inner)
    return Climbed(inner, whole.block_costs._replace(detour_start=start, detour=detour), ends)


@dataclass(eq=False)
class Nearby:
    """What an ascent looks at: near states, and where these are many, those where walks are cheap.

    Attributes:
        section, sets: what is ordered, and its down-sets.
        near: the near states.
        value: float64, room for the values of ``near``.
        chosen: the states that steps look at, as long as they may.
        reach: how much dearer walks through these may be than the cheapest, in travels of the mean length.
    """

    section: Section
    sets: DownSets
    near: Climbed
    value: NDArray[np.float64]
    chosen: Climbed | None = None
    reach: float = REACH

    @classmethod
    def among(
        cls,
        section: Section,
        sets: DownSets,
        whole: Climbed,
        value: NDArray[np.float64],
        pace: ArrayLike,
    ) -> "Nearby":
        """What to look at of ``whole`` to begin with; see ``near_states`` for ``pace``.

        Args:
            value: room for the values of the whole.
        """
        states = near_states(section, sets, whole.blocks, pace)
        near = climbed_among(section, sets, whole, states)
        if near is None:
            return cls(section, sets, whole, value)
        return cls(section, sets, near, np.empty(near.blocks.value_start[-1]))

    @property
    def chooses(self) -> bool:
        """Whether some of the near states are chosen."""
        # Walks through counts can turn anywhere, and are soon among other states. Where a nozzle's body ties
        # columns, rounds have too few steps for it: a proof of muscle_us_8x8 on marlin-syringe was lost.
        counted, tied = (self.sets.corridor == COUNTED).any(), len(self.section.ties) > 0
        return bool(self.near.blocks.arcs >= MANY and not counted and not tied)

    @property
    def arcs(self) -> int:
        """How many travels take as long as a step, with the looks in between."""
        return int(LIKELY_SHARE * self.near.blocks.arcs) if self.chooses else self.near.blocks.arcs

    def climb(
        self, ascent: Ascent, paid: Paid, lengths: NDArray[np.float64], target: float
    ) -> tuple[bool, float]:
        """Take steps, and say whether walks agree among all near states, and what bound these have.

        Args:
            ascent: where it is, which it changes.
            paid: room for what is paid.
            lengths: of the steps, in the unit of the costs.
            target: a cost that some sequence has.
        """
        if not self.chooses or len(lengths) < LEAST_STEPS:
            at_rest, _ = ascend(*self.near, ascent, paid, self.value, lengths)
            return at_rest, float(ascent.bound[0])
        best, multipliers = float(ascent.bound[0]), ascent.best.copy()
        for part in self._parts(lengths, target):
            if self.chosen is None:
                by_start = bound_at(*self.near, ascent.multipliers, paid, self.value)
                if by_start.min() > best:
                    best, multipliers = float(by_start.min()), ascent.multipliers.copy()
                self.chosen = self._choose(paid, by_start, target)
            ascent.bound[0] = -np.inf  # what is best is that of this part, as long as not all states say so
            at_rest, _ = ascend(*self.chosen, ascent, paid, self.value, part)
            hoped = found = float(ascent.bound[0])
            if self.chosen is not self.near:
                found = float(bound_at(*self.near, ascent.best, paid, self.value).min())
            if found > best:
                best, multipliers = found, ascent.best.copy()
            if self.chosen is self.near and at_rest:
                break
            lost = (hoped - found) / (self.reach * max(target, hoped) / self.section.n)
            if at_rest or lost > DRIFTED or self.chosen is self.near:
                self.chosen = None
            if at_rest or lost > ASTRAY:
                self.reach *= 2.0
                ascent.multipliers[:] = multipliers
                ascent.direction[:] = 0.0
        ascent.best[:], ascent.bound[0] = multipliers, best
        return at_rest and self.chosen is self.near, best

    def _parts(self, lengths: NDArray[np.float64], target: float) -> list[NDArray[np.float64]]:
        """Steps of these lengths in parts that go about as far as ``STRIDE``."""
        part = (np.cumsum(lengths) / (STRIDE * max(target, float(lengths[0])))).astype(np.int64)
        return np.split(lengths, np.flatnonzero(np.diff(part)) + 1)

    def _choose(self, paid: Paid, by_start: NDArray[np.float64], target: float) -> Climbed:
        """The near states through which walks are cheap at the multipliers that these arguments are of."""
        least = bound_through_states(*self.near, paid, self.value, by_start)
        arcs, reach = self.near.blocks.arcs_at, self.reach * target / self.section.n
        states = least <= by_start.min() + reach
        while reach < target and arcs[states].sum() < LEAST_SHARE * arcs.sum():
            reach *= 1.5
            states = least <= by_start.min() + reach
        states[self.near.blocks.state_start[:-1]] = True
        return climbed_among(self.section, self.sets, self.near, states) or self.near
