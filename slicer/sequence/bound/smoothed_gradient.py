"""How the smoothed bound grows with each multiplier: what walks use it, and which of its two sides."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.bound.jumps import passing_price
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.bound.smoothed_shares import Shares
from slicer.sequence.states import Blocks


@bare_kernel
def add_gradient(
    blocks: Blocks,
    block_costs: BlockCosts,
    shares: Shares,
    source: NDArray[np.int32],
    gradient: NDArray[np.float64],
    use: NDArray[np.float64],
) -> None:
    """Add to ``gradient`` how the bound grows with each multiplier, to ``use`` what share of walks has it.

    The reverse of ``apply_multipliers`` and ``charge_visits``.
    """
    arc_share, way_share = shares.arc, shares.ways
    for way in range(4):
        for at in range(way_share.shape[1]):
            share = way_share[way, at]
            if share == 0.0:
                continue
            if block_costs.price_at[way, at] >= 0:
                number = block_costs.price_at[way, at]
                gradient[number] += block_costs.price_sign[way, at] * share
                use[number] += share
            if source[way, at] >= 0:
                jumps = shares.jumps[way, at]
                gradient[source[way, at]] += jumps if way < ENTER_LEFT else -jumps
                use[source[way, at]] += jumps
            if way >= ENTER_LEFT:
                _visit(block_costs, at >> 1, share, gradient, use)
        for s in range(blocks.down_sets):
            share = shares.passing[way, s]
            if share > 0.0:
                number = passing_price(blocks, block_costs.jumps, way, s)
                gradient[number] += share if way < ENTER_LEFT else -share
                use[number] += share
    prices = block_costs.pair_start[-1]
    size = (block_costs.visits - prices) // 4
    for k in range(len(blocks.state_start) - 1):
        low, high = 2 * blocks.path_start[k], 2 * blocks.path_start[k + 1]
        left, right = blocks.bounds[k], blocks.bounds[k + 1]
        first = 0
        for from_column in range(left, right + 1):
            last = first + 2 * blocks.column_size[from_column]
            pairs = block_costs.pair_start[from_column]
            from_seam = block_costs.pair_start[from_column + 1] > pairs
            sign = 1.0 if from_column == right else -1.0
            for a in range(first, last):
                row = block_costs.arc_start[k] + a * (high - low)
                u = 2 * blocks.path[(low + a) >> 1] + (a & 1)
                b = 0
                for to_column in range(left, right + 1):
                    to_seam = block_costs.pair_start[to_column + 1] > block_costs.pair_start[to_column]
                    leave, enter = LEAVE_LEFT, ENTER_RIGHT
                    if to_column > from_column:
                        leave, enter = LEAVE_RIGHT, ENTER_LEFT
                    out = 0.0
                    for _ in range(2 * blocks.column_size[to_column]):
                        share = arc_share[row + b]
                        if share > 0.0:
                            _visit(block_costs, (low + b) >> 1, share, gradient, use)
                            if from_column != to_column:
                                out += share
                                if to_seam:
                                    number = prices + enter * size + 2 * blocks.path[(low + b) >> 1] + (b & 1)
                                    gradient[number] -= share
                                    use[number] += share
                            elif from_seam:
                                number = pairs + (a - first) * (last - first) + b - first
                                gradient[number] += sign * share
                                use[number] += share
                        b += 1
                    if from_seam and out > 0.0:
                        number = prices + leave * size + u
                        gradient[number] -= out
                        use[number] += out
            first = last


@inner_kernel
def _visit(
    block_costs: BlockCosts,
    place: int,
    share: float,
    gradient: NDArray[np.float64],
    use: NDArray[np.float64],
) -> None:
    """Enter visits of the toolpath at this place of ``Blocks.path``, where they have multipliers."""
    if block_costs.visits < block_costs.visits_end:
        gradient[block_costs.visits + place] += share
        use[block_costs.visits + place] += share
