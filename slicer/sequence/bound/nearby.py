"""The states that an ascent looks at where it need not look at all: of columns that are about equally done.

Good sequences keep neighbouring columns at about the same pace, and so do the cheap walks of a bound. Prices
rise among such states as they would among all, in a fraction of the time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.sequence.bound.detours import still_there
from slicer.sequence.bound.ends import Ends, find_ends
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import Blocks, DownSets, Section, connect, set_sizes

PACE = 28.0
"""How many toolpaths, on average, a column may be ahead of its neighbour."""
FEWER = 0.8
"""With more of all travels left, looks at all states in between cost more than is saved."""


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


def nearby(section: Section, sets: DownSets, whole: Climbed, pace: ArrayLike) -> Climbed | None:
    """Those of ``whole`` that are ``near_states``; None if hardly fewer, or where no walk keeps to them."""
    blocks = whole.blocks
    near = near_states(section, sets, blocks, pace)
    # Of the travels that near states have, hardly any leads to one that is not.
    if blocks.arcs_at[near].sum() > FEWER * blocks.arcs:
        return None
    inner = connect(section, sets, blocks.bounds, blocks.among(near, sets))
    if (np.diff(inner.state_start) == 0).any():
        return None
    ends = find_ends(section, sets, inner)
    if len(ends.starts) == 0:
        return None
    start, detour = still_there(blocks, whole.block_costs, inner)
    return Climbed(inner, whole.block_costs._replace(detour_start=start, detour=detour), ends)
