"""Multipliers that let walks through relaxed states print every toolpath once.

Where states are counts (``states.group_counts``), the cheapest walk of a block may print one toolpath twice
and another one not at all. Each visit of a toolpath in a block then costs a multiplier more, and the
multipliers of all toolpaths are taken off again: nothing for a sequence, which prints each once (Lagrangian
relaxation). There are none where states are down-sets.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import Blocks


@inner_kernel
def settle_visits(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    multipliers: NDArray[np.float64],
    by_start: NDArray[np.float64],
) -> None:
    """Pay in ``by_start`` for the first toolpath, which nothing enters, and take all multipliers off."""
    visits = block_costs.visits
    if visits == block_costs.visits_end:
        return
    total = 0.0
    for at in range(visits, block_costs.visits_end):
        total += multipliers[at]
    for t in range(len(by_start)):
        by_start[t] -= total
        for k in range(ends.start_home[t, 0], ends.start_home[t, 1] + 1):
            by_start[t] += multipliers[visits + _place(blocks, k, ends.starts[t] >> 1)]


@inner_kernel
def settle_in_subgradient(
    blocks: Blocks, block_costs: BlockCosts, ends: Ends, start: int, subgradient: NDArray[np.float64]
) -> None:
    """Enter what ``settle_visits`` does into a subgradient, for a start."""
    visits = block_costs.visits
    if visits == block_costs.visits_end:
        return
    for at in range(visits, block_costs.visits_end):
        subgradient[at] -= 1.0
    for k in range(ends.start_home[start, 0], ends.start_home[start, 1] + 1):
        subgradient[visits + _place(blocks, k, ends.starts[start] >> 1)] += 1.0


@inner_kernel
def _place(blocks: Blocks, k: int, s: int) -> int:
    """Where block k has toolpath s in ``Blocks.path``."""
    at = int(blocks.path_start[k])
    while blocks.path[at] != s:
        at += 1
    return at
