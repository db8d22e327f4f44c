"""Which states are looked at: all of them where they are few enough, else a corridor around an incumbent.

In a corridor the search is exact among sequences that resemble the incumbent, which is one of them, but
bounds on all sequences do not follow.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.blocks import cover
from slicer.sequence.downsets import DownSets, down_sets
from slicer.sequence.section import Section

MOST_DENSE = 100_000_000
"""Pairs of down-sets that are tabulated at all, at one byte each and four for a while."""


@dataclass(frozen=True, eq=False)
class Corridor:
    """The down-sets of each column, and the pairs of them that are looked at.

    Attributes:
        sets: the down-sets.
        bounds: int32 (b + 1,), the cover of the columns by pairs, see ``Blocks``.
        allowed: for each pair of columns, bool (down-sets, down-sets); None where all are.
        complete: whether nothing is left out.
    """

    sets: DownSets
    bounds: NDArray[np.int32]
    allowed: list[NDArray[np.bool_]] | None
    complete: bool


def widest_corridor(section: Section, guide: NDArray[np.int32], most_states: int) -> Corridor | None:
    """The widest corridor around a printable order with at most so many states; None if none is so small.

    Columns with too many down-sets keep those near the guide's, see ``down_sets``. If that is not
    enough, then of each two neighbours only those pairs of down-sets are kept that the guide passes at
    about the same time.

    Args:
        section: what is ordered.
        guide: int32 (n,), toolpaths in a printable order.
        most_states: the most states of all blocks together.
    """
    bounds = cover(section.columns, 2)
    pairs = max(1, len(bounds) - 1)
    limit = 8 * int(np.sqrt(most_states / pairs)) + 8
    while True:
        sets = down_sets(section, limit, guide)
        count = sets.count
        states = int((count[bounds[:-1]] * np.where(np.diff(bounds) > 0, count[bounds[1:]], 1)).sum())
        if states <= most_states:
            return Corridor(sets, bounds, None, sets.complete)
        if limit <= 2 * sets.size.max():
            break
        limit //= 2
    if states > MOST_DENSE or len(bounds) < 2:
        return None
    sizes, times = _sizes(sets), _times(section, sets, guide)
    reach = section.n
    while reach > 1:
        reach //= 2
        near = [
            np.maximum.outer(times[a][:-1], times[b][:-1])
            <= np.minimum.outer(times[a][1:], times[b][1:]) + reach
            for a, b in zip(bounds[:-1], bounds[1:], strict=True)
        ]
        states = sum(
            int(np.bincount(sizes[a]) @ mask.astype(np.int64) @ np.bincount(sizes[b]))
            for mask, a, b in zip(near, bounds[:-1], bounds[1:], strict=True)
        )
        if states <= most_states:
            allowed = [
                mask[np.ix_(sizes[a], sizes[b])]
                for mask, a, b in zip(near, bounds[:-1], bounds[1:], strict=True)
            ]
            return Corridor(sets, bounds, allowed, False)
    return None


def _sizes(sets: DownSets) -> list[NDArray[np.int64]]:
    """For each column, int64 (d,), how many toolpaths each of its down-sets holds."""
    size = np.zeros(sets.start[-1], np.int64)
    for i in range(len(size)):
        size[sets.step_to[sets.step_start[i] : sets.step_start[i + 1]]] = size[i] + 1
    return [size[a:b] for a, b in zip(sets.start[:-1], sets.start[1:], strict=True)]


def _times(section: Section, sets: DownSets, guide: NDArray[np.int32]) -> list[NDArray[np.int64]]:
    """For each column, int64 (size + 2,), when the guide has printed 0, 1, 2 .. of it, and its end."""
    column = section.column[guide]
    return [
        np.concatenate([[0], np.flatnonzero(column == c) + 1, [section.n]]) for c in range(len(sets.size))
    ]
