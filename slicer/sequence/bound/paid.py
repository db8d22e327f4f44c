"""What blocks of columns pay for travels at some multipliers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel

LEAVE_LEFT, LEAVE_RIGHT, ENTER_LEFT, ENTER_RIGHT = range(4)
"""Ways out of a block and into it."""
LEFT_OFF, ENTERED = range(2)
"""The ends of a travel, in ``Paid.price``."""


class Moved(NamedTuple):
    """The travels inside seam columns whose multipliers some walk has moved; those of all others are 0.

    They are few of all, and so a step looks at these alone.

    Attributes:
        known: int64 (1,), how many there are.
        multiplier: int64 (m,), their multipliers; room for those of all travels.
        travel: int64 (m, 2), their numbers in ``BlockCosts.direct``, in the block that has the column as its
            last one, and in the block that has it as its first.
        is_known: bool (m,), for each multiplier whether it is among them.
    """

    known: NDArray[np.int64]
    multiplier: NDArray[np.int64]
    travel: NDArray[np.int64]
    is_known: NDArray[np.bool_]


class Paid(NamedTuple):
    """What blocks pay at some multipliers.

    Attributes:
        arc: float64, for each travel inside a block, numbered as ``BlockCosts.direct``, without what follows.
        price: float64 (2, p), what is off a travel from one column of a block to another, at the end that it
            leaves, and at the one that it enters.
        visit: float64 (p / 2,), what is added for each visit of a toolpath.
        moved: the travels that do not cost as much as at first.
        ways: float64 (4, p), for each way of leaving or entering, as ``BlockCosts.ways``; for a jump, without
            what depends on the column that it passes over.
        least, most: float64 (4, p), no less and no more than these is paid; as ``ways`` where it is no jump.
        passing: float64 (4, d), what is added to a jump at each down-set of the column that it passes over.
        source: int32 (4, p), the price at the end that a jump leaves: leaving grows with it, entering falls;
            -1 for others.
    """

    arc: NDArray[np.float64]
    price: NDArray[np.float64]
    visit: NDArray[np.float64]
    moved: Moved
    ways: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]
    passing: NDArray[np.float64]
    source: NDArray[np.int32]


@inner_kernel
def way_cost(paid: Paid, way: int, at: int, passing: float) -> float:
    """What a block pays for leaving or entering an oriented toolpath.

    Args:
        paid: what it pays at some multipliers.
        way, at: how, and the toolpath in the numbers of all blocks.
        passing: ``Paid.passing`` of that way at the down-set of the column on that side.
    """
    return float(max(paid.least[way, at], min(paid.ways[way, at] + passing, paid.most[way, at])))


@inner_kernel
def between(paid: Paid, way: int, at: int, down_set: int) -> bool:
    """Whether what is paid for a jump over a down-set is neither the least nor the most, and so grows."""
    cost = paid.ways[way, at] + paid.passing[way, down_set]
    return bool(paid.least[way, at] < cost < paid.most[way, at])
