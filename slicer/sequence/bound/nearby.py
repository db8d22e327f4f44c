"""The states that an ascent looks at where it need not look at all: of columns that are about equally done.

Good sequences keep neighbouring columns at about the same pace, and so do the cheap walks of a bound. Prices
rise among such states as they would among all, in a fraction of the time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.detours import still_there
from slicer.sequence.bound.ends import Ends, find_ends
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import Blocks, DownSets, Section, connect, set_sizes

PACE = 28.0
"""How many toolpaths, on average, a column may be ahead of its neighbour."""


class Climbed(NamedTuple):
    """What an ascent looks at: states, what they pay, and where walks through them begin and end."""

    blocks: Blocks
    block_costs: BlockCosts
    ends: Ends


def nearby(section: Section, sets: DownSets, whole: Climbed, pace: float) -> Climbed | None:
    """Those of ``whole`` whose neighbouring columns are at most ``pace`` toolpaths apart, on average.

    None if they are all, or if no walk keeps to them.
    """
    slack = pace * section.columns / section.n
    if slack >= 1.0:
        return None
    done = [size / size[-1] for size in set_sizes(sets)]
    blocks = whole.blocks
    among = []
    for k in range(blocks.blocks):
        alive = blocks.alive(k, sets)
        first, last = int(blocks.bounds[k]), int(blocks.bounds[k + 1])
        for column in range(first, last):
            shape = np.ones(alive.ndim, np.intp)
            shape[column - first : column - first + 2] = -1, len(done[column + 1])
            near = _near(done[column], done[column + 1], slack)
            alive &= near.reshape(shape)
        among.append(alive)
    inner = connect(section, sets, blocks.bounds, among)
    if (np.diff(inner.state_start) == 0).any():
        return None
    ends = find_ends(section, sets, inner)
    if len(ends.starts) == 0:
        return None
    start, detour = still_there(blocks, whole.block_costs, inner)
    return Climbed(inner, whole.block_costs._replace(detour_start=start, detour=detour), ends)


def _near(left: NDArray[np.float64], right: NDArray[np.float64], slack: float) -> NDArray[np.bool_]:
    """bool (a, b), whether shares of two columns that are done differ by no more than ``slack``."""
    return np.abs(left[:, None] - right) <= slack
