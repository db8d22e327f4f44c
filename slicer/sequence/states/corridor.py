"""Which states are looked at: all of them where they are few enough, else a corridor around an incumbent.

In a corridor the search is exact among sequences that resemble the incumbent, which is one of them, but
bounds on all sequences do not follow.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.blocks import cover
from slicer.sequence.states.downsets import DownSets, all_down_sets, down_sets
from slicer.sequence.states.joint_states import closed_share
from slicer.sequence.states.section import Section

MERGED_STATES = 20_000
"""Columns with few down-sets go together into blocks of up to so many states, which tightens the bound."""
MOST_ARCS = 200_000_000
"""Whatever the effort, the bound looks at no more travels; this takes about 1.5 GB."""
MOST_TRAVELS = 40_000_000
"""Travels between the toolpaths of neighbouring columns that are tabulated at all, at 16 bytes each."""
MOST_SETS = 20_000
"""Down-sets of a column of which all are looked at, however few of them go together with others."""
MOST_DENSE = 100_000_000
"""Pairs of down-sets that are tabulated at all, at one byte each and four for a while."""


@dataclass(frozen=True, eq=False)
class Corridor:
    """The down-sets of each column, and the pairs of them that are looked at.

    Attributes:
        sets: the down-sets.
        bounds: int32 (b + 1,), the cover of the columns by blocks, see ``Blocks``.
        allowed: for each block, bool of the shape of its down-sets; None where all states are.
        complete: whether nothing is left out.
    """

    sets: DownSets
    bounds: NDArray[np.int32]
    allowed: list[NDArray[np.bool_]] | None
    complete: bool


def widest_corridor(section: Section, guide: NDArray[np.int32], most_arcs: int) -> Corridor | None:
    """The widest corridor around a printable order with at most so many arcs; None if none is so small.

    Columns with too many down-sets keep those near the guide's, see ``down_sets``. If that is not
    enough, then of each two neighbours only those pairs of down-sets are kept that the guide passes at
    about the same time.

    Args:
        section: what is ordered.
        guide: int32 (n,), toolpaths in a printable order.
        most_arcs: the most travels that one evaluation of the bound looks at, which is what it costs.
    """
    most_arcs = min(most_arcs, MOST_ARCS)
    size = np.bincount(section.column).astype(np.int64)
    if not _tabulated(size):
        return None
    bounds = pairs_of(section)
    limit = max(int(np.sqrt(most_arcs / max(1, section.columns - 1))), 2 * int(size.max()))
    while True:
        sets = down_sets(section, limit, guide)
        states, arcs = extent(sets, bounds)
        if states <= MOST_DENSE:
            arcs = int(arcs * closed_share(section, sets, bounds))
        if arcs <= most_arcs and states <= MOST_DENSE:
            return Corridor(sets, cover(sets, MERGED_STATES), None, sets.complete)
        if limit <= 2 * sets.size.max():
            break
        limit = max(limit // 2, int(2 * sets.size.max()))
    if states > MOST_DENSE or len(bounds) < 2:
        return None
    sizes, times = set_sizes(sets), _times(section, sets, guide)
    histogram = [np.bincount(size) for size in sizes]
    reach = section.n
    while reach > 1:
        reach //= 2
        near = [
            np.maximum.outer(times[a][:-1], times[b][:-1])
            <= np.minimum.outer(times[a][1:], times[b][1:]) + reach
            for a, b in pairwise(bounds)
        ]
        kept = sum(
            int(histogram[a] @ mask.astype(np.int64) @ histogram[b])
            for mask, (a, b) in zip(near, pairwise(bounds), strict=True)
        )
        if kept * arcs <= most_arcs * states:
            allowed = [
                mask[np.ix_(sizes[a], sizes[b])] for mask, (a, b) in zip(near, pairwise(bounds), strict=True)
            ]
            return Corridor(sets, bounds, allowed, False)
    return None


def complete_corridor(section: Section, most_arcs: int) -> Corridor | None:
    """All states of a section, if they make so few travels; see ``widest_corridor``."""
    if not _tabulated(np.bincount(section.column).astype(np.int64)):
        return None
    sets = all_down_sets(section, MOST_SETS)
    if sets is None:
        return None
    bounds = pairs_of(section)
    states, arcs = extent(sets, bounds)
    if states > MOST_DENSE or arcs * closed_share(section, sets, bounds) > most_arcs:
        return None
    return Corridor(sets, cover(sets, MERGED_STATES), None, True)


def _tabulated(size: NDArray[np.int64]) -> bool:
    """Whether columns with so many toolpaths are small enough for the travels between neighbours."""
    return int(((2 * (size[:-1] + size[1:])) ** 2).sum()) <= MOST_TRAVELS


def pairs_of(section: Section) -> NDArray[np.int32]:
    """The bounds of blocks of two columns; of one where there is but one."""
    return np.arange(section.columns, dtype=np.int32) if section.columns > 1 else np.zeros(2, np.int32)


def extent(sets: DownSets, bounds: NDArray[np.int32]) -> tuple[int, int]:
    """The states of all blocks of one or two columns, and their arcs: ends times next entries of each."""
    moves, tops = np.diff(sets.step_start).astype(np.int64), np.diff(sets.top_start).astype(np.int64)
    first = sets.start[:-1]
    per_column = [np.add.reduceat(x, first) for x in (np.ones_like(moves), moves, tops, moves * tops)]
    states = arcs = 0
    for a, b in pairwise(bounds):
        ones, steps, ends, both = ([int(x[a]), int(x[b])] for x in per_column)
        if a == b:
            return ones[0], 4 * both[0]
        states += ones[0] * ones[1]
        arcs += 4 * (both[0] * ones[1] + ones[0] * both[1] + steps[0] * ends[1] + ends[0] * steps[1])
    return states, arcs


def set_sizes(sets: DownSets) -> list[NDArray[np.int64]]:
    """For each column, int64 (d,), how many toolpaths each of its down-sets holds; they ascend."""
    size = np.zeros(sets.start[-1], np.int64)
    for i in range(len(size)):
        size[sets.step_to[sets.step_start[i] : sets.step_start[i + 1]]] = size[i] + 1
    return [size[a:b] for a, b in pairwise(sets.start)]


def _times(section: Section, sets: DownSets, guide: NDArray[np.int32]) -> list[NDArray[np.int64]]:
    """For each column, int64 (size + 2,), when the guide has printed 0, 1, 2 .. of it, and its end."""
    column = section.column[guide]
    return [
        np.concatenate([[0], np.flatnonzero(column == c) + 1, [section.n]]) for c in range(len(sets.size))
    ]
