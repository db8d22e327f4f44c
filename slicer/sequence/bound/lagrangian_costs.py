"""What each block of columns pays for its travels at some multipliers, see ``pair_costs``."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.bound.jumps import price_jumps
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Paid
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import Blocks


@inner_kernel
def apply_multipliers(
    blocks: Blocks,
    block_costs: BlockCosts,
    multipliers: NDArray[np.float64],
    paid: Paid,
) -> None:
    """What each block pays at these multipliers, into ``paid``."""
    arc, ways = paid.arc, paid.ways
    count = len(blocks.state_start) - 1
    for way in range(4):
        for at in range(ways.shape[1]):
            ways[way, at] = block_costs.ways[way, at]
            if block_costs.price_at[way, at] >= 0:
                ways[way, at] += block_costs.price_sign[way, at] * multipliers[block_costs.price_at[way, at]]
            paid.least[way, at] = paid.most[way, at] = ways[way, at]
    price_jumps(blocks, block_costs.jumps, block_costs.ways, multipliers, paid)
    prices = multipliers[block_costs.pair_start[-1] : block_costs.visits].reshape(4, -1)
    for k in range(count):
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
                out_left = prices[LEAVE_LEFT, u] if from_seam else 0.0
                out_right = prices[LEAVE_RIGHT, u] if from_seam else 0.0
                b = 0
                for to_column in range(left, right + 1):
                    to_seam = block_costs.pair_start[to_column + 1] > block_costs.pair_start[to_column]
                    way = ENTER_LEFT if to_column > from_column else ENTER_RIGHT
                    out = out_right if to_column > from_column else out_left
                    for _ in range(2 * blocks.column_size[to_column]):
                        cost = block_costs.direct[row + b]
                        if from_column != to_column:
                            v = 2 * blocks.path[(low + b) >> 1] + (b & 1)
                            cost -= out + (prices[way, v] if to_seam else 0.0)
                        elif from_seam:
                            cost = (
                                0.5 * cost
                                + sign * multipliers[pairs + (a - first) * (last - first) + b - first]
                            )
                        arc[row + b] = cost
                        b += 1
            first = last
