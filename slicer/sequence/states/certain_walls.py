"""What a travel costs at least because of what surely stands when it is made.

Before one toolpath can follow another, all must be printed that has to come before either of the two. Of a
sheet whose columns a nozzle's body ties that is much, and over it many travels have to rise: where their
prices count it, the bound of 4x4 random tiles under a brass nozzle comes from 31.6 s to 38.7, of 39.0.

More may stand than that, which makes the string over it longer. It may be quicker all the same, since it may
have fewer corners, in each of which the nozzle comes to rest. But it rises at least as high, up and down
again; and it begins and ends upright, at least as high above its ends, and goes across in between.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.reach import MOST_LINES
from slicer.sequence.problem import CostModel, leg_cost, string_cost
from slicer.sequence.states.closure import comes_before, never_follows
from slicer.sequence.states.column_skylines import Skylines, over_nothing
from slicer.sequence.states.routed_travel import leaving_above, pieces_above, string_over
from slicer.sequence.states.section import Section
from slicer.skyline import FULL, Skyline, append, clear, copied, lay, skyline_with_room
from slicer.taut_string import EPS_MM

MOST_TOOLPATHS = 3_000
"""Of more, what comes before what takes too long to find."""
MOST_PRICED = 6_000_000
"""At 0.15 to 0.4 microseconds each."""
ROUNDING = 1.0 - 1e-9


class Before(NamedTuple):
    """How what must come before each toolpath is laid, one after the other.

    Attributes:
        order: int64 (n,), the toolpaths, each behind all that must come before it.
        base: int64 (n,), for each the one before it that most must come before; -1 where there is none.
        start, more: int64, what else must come before it, as rows.
    """

    order: NDArray[np.int64]
    base: NDArray[np.int64]
    start: NDArray[np.int64]
    more: NDArray[np.int64]


def least_over_certain(
    section: Section, home: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Which travels surely rise over something, and what they cost at least.

    Args:
        section: what is ordered.
        home: int32 (n, 2), the first and the last block that each toolpath is in. Travels between toolpaths
            that share none are of no interest.

    Returns:
        int32 (m, 2), from which oriented toolpath to which, and float64 (m,), in the unit of the cost. Told
        for a nozzle with a body, before whose toolpaths nothing is printed, as long as there are no more
        than ``MOST_PRICED`` such travels.
    """
    n = section.n
    none = np.empty((0, 2), np.int32), np.empty(0)
    if n > MOST_TOOLPATHS or len(section.ground) or section.body.is_point or not section.routed:
        return none
    before = comes_before(section)
    follows = np.maximum.outer(home[:, 0], home[:, 0]) <= np.minimum.outer(home[:, 1], home[:, 1])
    follows &= ~never_follows(section, before)
    most = 4 * int(np.count_nonzero(follows))
    if most > MOST_PRICED:
        return none
    floor = float(section.segments[:, :, 1].min())
    start, piece = _certain_skylines(section, floor, before)
    points = 2 * (2 * int(np.diff(start).max()) + MOST_LINES + 1) + 8
    certain = over_nothing(section)._replace(
        start=start,
        piece=piece,
        hull=np.empty((points, 2)),
        over=np.empty((points, 2)),
        floor=floor,
    )
    pairs, cost = np.empty((most, 2), np.int32), np.empty(most)
    count = _price(section.segments, section.cost_model, certain, follows, before, pairs, cost)
    return pairs[:count], cost[:count] * ROUNDING


def _certain_skylines(
    section: Section, floor: float, before: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The skyline over all that must come before each toolpath: where its pieces begin, and they."""
    size = before.sum(axis=0)
    base = np.where(size > 0, np.argmax(np.where(before, size[:, None] + 1, 0), axis=0), -1)
    more = before.copy()
    has = base >= 0
    more[:, has] &= ~before[:, base[has]]
    more[base[has], np.flatnonzero(has)] = False
    of, rest = np.nonzero(more.T)
    rows = Before(np.argsort(size, kind="stable"), base, np.searchsorted(of, np.arange(section.n + 1)), rest)
    room = 64
    while True:
        start, piece = np.zeros((section.n, 2), np.int32), np.empty((room * section.n, 4))
        if _lay_before(skyline_with_room(room, section.body, floor), section.segments, rows, start, piece):
            break
        room *= 2
    count = np.diff(start)[:, 0]
    first = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
    kept = np.repeat(start[:, 0] - first[:-1], count) + np.arange(first[-1])
    return first, piece[kept]


@kernel
def _lay_before(
    sky: Skyline,
    segments: NDArray[np.float64],
    rows: Before,
    start: NDArray[np.int32],
    piece: NDArray[np.float64],
) -> bool:
    """Fill in where the pieces of each toolpath begin and end, and they; False where there is no room."""
    size = 0
    for s in rows.order:
        clear(sky)
        base = rows.base[s]
        if base >= 0:
            if start[base, 1] - start[base, 0] + 8 > len(sky.piece):
                return False
            for q in range(start[base, 0], start[base, 1]):
                append(sky, piece, q)
            if not lay(sky, segments[base]):
                return False
        for t in range(rows.start[s], rows.start[s + 1]):
            if not lay(sky, segments[rows.more[t]]):
                return False
        start[s, 0] = size
        size = copied(sky, piece, size)
        if size == FULL:
            return False
        start[s, 1] = size
    return True


@kernel
def _price(
    segments: NDArray[np.float64],
    cost_model: CostModel,
    sky: Skylines,
    follows: NDArray[np.bool_],
    before: NDArray[np.bool_],
    pairs: NDArray[np.int32],
    cost: NDArray[np.float64],
) -> int:
    """Fill in which travels surely rise over something, and their costs; how many. ``sky`` is by toolpath."""
    count = 0
    for s in range(len(segments)):
        for e in range(2):
            for t in range(len(segments)):
                if not follows[s, t]:
                    continue
                start = (segments[s, 1 - e, 0], segments[s, 1 - e, 1])
                for f in range(2):
                    end = (segments[t, f, 0], segments[t, f, 1])
                    least = _at_least(cost_model, sky, (s, segments[s]), (t, before[s, t]), start, end)
                    if least > 0.0:
                        pairs[count, 0], pairs[count, 1], cost[count] = 2 * s + e, 2 * t + f, least
                        count += 1
    return count


@inner_kernel
def _at_least(
    cost_model: CostModel,
    sky: Skylines,
    leaving: tuple[int, NDArray[np.float64]],
    to: tuple[int, bool],
    start: tuple[float, float],
    end: tuple[float, float],
) -> float:
    """What a travel costs at least over what surely stands; 0 where that does not make it rise.

    Args:
        leaving: the toolpath that it leaves.
        to: the one that it goes to, and whether the first one has to come before it. Then that one's skyline
            holds it as it is to all others, while the nozzle may press into what it has just laid.
    """
    (out_x, out_y), (in_x, in_y) = start, end
    onwards = out_x <= in_x
    ax, ay, bx, by = (out_x, out_y, in_x, in_y) if onwards else (in_x, in_y, out_x, out_y)
    if bx - ax <= EPS_MM:
        return 0.0
    line = (ax, ay, bx, (by - ay) / (bx - ax))
    s, (t, ordered) = leaving[0], to
    count = pieces_above(sky.over, 0, sky.piece, sky.start[s], sky.start[s + 1], line)
    if not ordered:
        count = pieces_above(sky.over, count, sky.piece, sky.start[t], sky.start[t + 1], line)
    count = leaving_above(sky, count, leaving, start, line)
    if count == 0:
        return 0.0
    size = string_over(sky.over, count, sky.hull, line)
    if not cost_model.timed:
        return string_cost(cost_model, sky.hull, size, onwards, start, end)
    clear, last = cost_model.clearance, size - 1
    peak = sky.hull[0, 1]
    for q in range(size):
        peak = max(peak, sky.hull[q, 1])
    vertically = leg_cost(cost_model, 0.0, peak + clear - ay) + leg_cost(cost_model, 0.0, peak + clear - by)
    across = leg_cost(cost_model, 0.0, sky.hull[0, 1] + clear - ay) + leg_cost(cost_model, bx - ax, 0.0)
    across += leg_cost(cost_model, 0.0, sky.hull[last, 1] + clear - by)
    cost = max(vertically, across)
    fixed_from = max(cost_model.fixed_from, EPS_MM)
    if cost_model.fixed > 0.0 and (bx - ax) ** 2 + (by - ay) ** 2 > fixed_from * fixed_from:
        cost += cost_model.fixed
    return cost
