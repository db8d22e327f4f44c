"""The ascent of the bound along subgradients: multipliers move where walks of neighbours disagree.

Steps shrink from one to the next by the same factor, from far too long ones to some that hardly move. They
need no target, and come farther than as many of Polyak's, or than quasi-Newton steps up a smoothed bound that
take as many seconds (docs/results.md).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.lagrangian_costs import note_all_moved
from slicer.sequence.bound.paid import Moved, Paid
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.bound.pair_dp import bound_by_start
from slicer.sequence.bound.pair_subgradient import add_subgradient
from slicer.sequence.states import Blocks

MOMENTUM = 0.8
FIRST_LENGTH, LAST_LENGTH = 0.16, 0.0008
"""Of steps, as parts of the cost: by so much the bound would rise if it went on as it begins.

Of 20x20 tiles, whose shortest sequence is proved, 40 such steps leave 0.26 %, 100 leave 0.15 %, and 120 of
Polyak's towards the optimum 0.6 %.
"""
AGAIN_LENGTH = 2.0
"""The first one where the multipliers are good ones already, as a part of the gap that is left."""
NOWHERE = 1e-12
"""Walks whose subgradient is so short agree."""


def step_lengths(steps: int, gap: float = 1.0, last: float = LAST_LENGTH) -> NDArray[np.float64]:
    """float64 (steps,), the lengths of so many steps, as parts of the cost.

    Args:
        steps: how many.
        gap: of the cost, the part that the bound is below it; with a small one steps are shorter at first.
        last: the length of the last one.
    """
    first = min(max(AGAIN_LENGTH * gap, last), FIRST_LENGTH)
    return np.geomspace(first, last, steps)


class Ascent(NamedTuple):
    """Where an ascent is.

    Attributes:
        multipliers, best: float64, where it is, and where the bound was best so far.
        direction: float64, the moving average of subgradients.
        bound: float64 (1,), the best bound.
    """

    multipliers: NDArray[np.float64]
    best: NDArray[np.float64]
    direction: NDArray[np.float64]
    bound: NDArray[np.float64]


def begin_ascent(multipliers: NDArray[np.float64]) -> Ascent:
    """An ascent from some multipliers on."""
    return Ascent(multipliers.copy(), multipliers.copy(), np.zeros_like(multipliers), np.array([-np.inf]))


@kernel
def ascend(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    ascent: Ascent,
    paid: Paid,
    value: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> tuple[bool, NDArray[np.float64]]:
    """Take steps along a moving average of subgradients; without any, only look at where it is.

    Python calls this one alone: the dynamic programme takes a second to compile, and once is enough.

    Returns:
        whether walks agree, and there is nowhere to go; and float64 (k,), what ``bound_by_start`` gave last.

    Args:
        ascent: where it is, carried between calls.
        paid, value: room, see ``bound_by_start``.
        lengths: of the steps, in the unit of the costs.
    """
    multipliers, best, direction, best_bound = ascent
    moved, others = paid.moved, block_costs.pair_start[-1]
    subgradient = np.zeros(len(multipliers))
    note_all_moved(blocks, block_costs, multipliers, moved)
    for k in range(max(1, len(lengths))):
        by_start = bound_by_start(blocks, block_costs, ends, multipliers, paid, value)
        if len(lengths) == 0:
            break
        start = 0
        for t in range(len(by_start)):
            if by_start[t] < by_start[start]:
                start = t
        higher = by_start[start] > best_bound[0]
        if higher:
            best_bound[0] = by_start[start]
        for a in range(_active(moved, block_costs)):
            t = _multiplier(moved, others, a)
            subgradient[t] = 0.0
            if higher:
                best[t] = multipliers[t]
        add_subgradient(blocks, block_costs, ends, paid, value, start, subgradient)
        norm, own = 0.0, 0.0
        for a in range(_active(moved, block_costs)):
            t = _multiplier(moved, others, a)
            direction[t] = MOMENTUM * direction[t] + (1.0 - MOMENTUM) * subgradient[t]
            norm += direction[t] * direction[t]
            own += subgradient[t] * subgradient[t]
        if own < NOWHERE:
            return True, by_start
        if norm < NOWHERE:
            continue
        step = (1.0 - MOMENTUM) * lengths[k] / norm
        for a in range(_active(moved, block_costs)):
            t = _multiplier(moved, others, a)
            multipliers[t] += step * direction[t]
    return False, by_start


@inner_kernel
def _active(moved: Moved, block_costs: BlockCosts) -> int:
    """How many multipliers are not known to be 0."""
    return int(moved.known[0] + block_costs.size - block_costs.pair_start[-1])


@inner_kernel
def _multiplier(moved: Moved, others: int, a: int) -> int:
    """The a-th of them: those of travels that have moved, then all ``others``, which follow all travels'."""
    count = moved.known[0]
    return int(moved.multiplier[a] if a < count else others + a - count)


def bound_at(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    multipliers: NDArray[np.float64],
    paid: Paid,
    value: NDArray[np.float64],
) -> NDArray[np.float64]:
    """What ``bound_by_start`` gives at some multipliers, which stay as they are."""
    here = Ascent(multipliers, multipliers, multipliers, np.empty(1))
    return ascend(blocks, block_costs, ends, here, paid, value, np.empty(0))[1]
