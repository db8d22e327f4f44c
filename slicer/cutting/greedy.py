"""Print what can be printed whole; where nothing can, cut the toolpath whose free end frees most others."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.cutting.hindering import ABOVE, hindering_part, hinders
from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel
from slicer.nozzle import NozzleBody

NONE = -1
LOOKED_AT = 48
"""Toolpaths that are tried first at each cut: those that hinder the fewest others."""


class Remaining(NamedTuple):
    """What is not printed yet: of each toolpath one part, or nothing.

    Attributes:
        segments: float64 (n, 2, 2) in mm.
        span: float64 (n, 2), from where to where, in parts of the toolpath's length.
        waits: int32 (n,), how many others must be printed before it, since it would hinder them.
        hinders: bool (n, n), whether [b], printed, makes [c] unprintable.
        alive: bool (n,), whether something of it remains.
    """

    segments: NDArray[np.float64]
    span: NDArray[np.float64]
    waits: NDArray[np.int32]
    hinders: NDArray[np.bool_]
    alive: NDArray[np.bool_]


class Room(NamedTuple):
    """Arrays to work in, for kernels that allocate nothing."""

    polygons: NDArray[np.float64]
    waits: NDArray[np.int32]
    queue: NDArray[np.int32]
    part: NDArray[np.float64]


@kernel
def cut_greedily(
    body: NozzleBody, segments: NDArray[np.float64], least: float, most: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Cut toolpaths so that they can be printed, each as late as can be.

    To print more of what hinders nobody takes nothing from the others, so a cut is made where the free end of
    a toolpath ceases to be free, and only when nothing whole is left that can be printed.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        least: no part is shorter, in mm.
        most: parts to be made at most.

    Returns:
        (toolpath int32 (m,), span float64 (m, 2)): the parts in an order in which they can be printed; less
        than everything where ``most`` is too few, or no end of ``least`` hinders nobody.
    """
    n = len(segments)
    rest = _begin(body, segments)
    room = Room(np.empty((2, 12, 2)), np.empty(n, np.int32), np.empty(n, np.int32), np.empty((2, 2)))
    owner = np.empty(most, np.int32)
    span = np.empty((most, 2))
    made = 0
    left = n
    while made + left <= most:
        printed = 0
        for b in range(n):
            if rest.alive[b] and rest.waits[b] == 0:
                owner[made] = b
                span[made, 0], span[made, 1] = rest.span[b, 0], rest.span[b, 1]
                made += 1
                printed += 1
                _take_away(rest, b)
        left -= printed
        if printed > 0:
            continue
        if left == 0 or made + left == most:
            break
        b, side, at = _best_cut(body, rest, least, room)
        if b == NONE:
            break
        first, last = rest.span[b, 0], rest.span[b, 1]
        cut = first + at * (last - first)
        owner[made] = b
        if side == 0:
            span[made, 0], span[made, 1] = first, cut
            _shorten(body, rest, b, segments[b], cut, last)
        else:
            span[made, 0], span[made, 1] = cut, last
            _shorten(body, rest, b, segments[b], first, cut)
        made += 1
    return owner[:made].copy(), span[:made].copy()


@allocating_inner_kernel
def _begin(body: NozzleBody, segments: NDArray[np.float64]) -> Remaining:
    n = len(segments)
    rest = Remaining(
        segments.copy(),
        np.empty((n, 2)),
        np.zeros(n, np.int32),
        np.zeros((n, n), np.bool_),
        np.ones(n, np.bool_),
    )
    for b in range(n):
        rest.span[b, 0], rest.span[b, 1] = 0.0, 1.0
        for c in range(n):
            if b != c and hinders(body, segments[b], segments[c]):
                rest.hinders[b, c] = True
                rest.waits[b] += 1
    return rest


@inner_kernel
def _take_away(rest: Remaining, b: int) -> None:
    rest.alive[b] = False
    for c in range(len(rest.alive)):
        if rest.alive[c] and rest.hinders[c, b]:
            rest.waits[c] -= 1


@inner_kernel
def _best_cut(body: NozzleBody, rest: Remaining, least: float, room: Room) -> tuple[int, int, float]:
    """(toolpath, its end, where to cut in parts of its length), or (NONE, 0, 0) where no end is free."""
    best, best_side, best_at, best_gain = NONE, 0, 0.0, -1.0
    count = LOOKED_AT
    seen = -1  # those who wait for no more than so many have been tried
    while best == NONE and seen < len(rest.alive):
        limit = _waits_of(rest, count)
        count *= 4
        for b in range(len(rest.alive)):
            if not rest.alive[b] or rest.waits[b] > limit or rest.waits[b] <= seen:
                continue
            s = rest.segments[b]
            length = np.sqrt((s[1, 0] - s[0, 0]) ** 2 + (s[1, 1] - s[0, 1]) ** 2)
            for side in range(2):
                # What remains must not be too short either.
                part = min(_free_end(body, rest, b, side, room), 1.0 - least / length)
                if part * length < least:
                    continue
                at = part if side == 0 else 1.0 - part
                gain = _freed(body, rest, b, side, at, room) + 1e-3 * part
                if gain > best_gain:
                    best, best_side, best_at, best_gain = b, side, at, gain
        seen = max(limit, seen + 1)
    return best, best_side, best_at


@inner_kernel
def _waits_of(rest: Remaining, count: int) -> int:
    """The least number of others that ``count`` toolpaths wait for no more than."""
    limit = 0
    while True:
        found = 0
        following = 1 << 30
        for b in range(len(rest.alive)):
            if rest.alive[b]:
                if rest.waits[b] <= limit:
                    found += 1
                else:
                    following = min(following, rest.waits[b])
        if found >= count or following == 1 << 30:
            return limit
        limit = following


@inner_kernel
def _free_end(body: NozzleBody, rest: Remaining, b: int, side: int, room: Room) -> float:
    """How much of what remains of b hinders nobody, from its end ``side`` on."""
    free = 1.0
    for c in range(len(rest.alive)):
        if rest.alive[c] and c != b and rest.hinders[b, c]:
            for part in range(ABOVE + 1):
                low, high, _, _ = hindering_part(
                    body, rest.segments[b], rest.segments[c], part, room.polygons
                )
                if low <= high:
                    free = min(free, low if side == 0 else 1.0 - high)
    return free


@inner_kernel
def _freed(body: NozzleBody, rest: Remaining, b: int, side: int, at: float, room: Room) -> int:
    """How many toolpaths can be printed whole once b is, but for what lies beyond the cut ``at``."""
    kept = room.part
    s = rest.segments[b]
    for axis in range(2):
        cut = s[0, axis] + at * (s[1, axis] - s[0, axis])
        kept[0, axis] = cut if side == 0 else s[0, axis]
        kept[1, axis] = s[1, axis] if side == 0 else cut
    n = len(rest.alive)
    waits, queue = room.waits, room.queue
    for c in range(n):
        waits[c] = rest.waits[c] if rest.alive[c] else NONE
    waits[b] = 0
    for c in range(n):
        if rest.alive[c] and c != b and rest.hinders[b, c] and hinders(body, kept, rest.segments[c]):
            waits[b] += 1
    size = 0
    for c in range(n):
        if waits[c] == 1 and c != b and rest.hinders[c, b] and not hinders(body, rest.segments[c], kept):
            waits[c] = NONE
            queue[size] = c
            size += 1
    done = 0
    while done < size:
        x = queue[done]
        done += 1
        for c in range(n):
            if waits[c] <= 0 or not rest.hinders[c, x]:
                continue
            waits[c] -= 1
            last = waits[c] == 1 and c != b and waits[b] != NONE and rest.hinders[c, b]
            if waits[c] == 0 or (last and not hinders(body, rest.segments[c], kept)):
                waits[c] = NONE
                queue[size] = c
                size += 1
    return size


@inner_kernel
def _shorten(
    body: NozzleBody, rest: Remaining, b: int, whole: NDArray[np.float64], first: float, last: float
) -> None:
    """Let only a part of b remain, which can hinder and be hindered by fewer."""
    rest.span[b, 0], rest.span[b, 1] = first, last
    for axis in range(2):
        rest.segments[b, 0, axis] = whole[0, axis] + first * (whole[1, axis] - whole[0, axis])
        rest.segments[b, 1, axis] = whole[0, axis] + last * (whole[1, axis] - whole[0, axis])
    rest.waits[b] = 0
    for c in range(len(rest.alive)):
        if not rest.alive[c] or c == b:
            continue
        if rest.hinders[b, c]:
            rest.hinders[b, c] = hinders(body, rest.segments[b], rest.segments[c])
            rest.waits[b] += rest.hinders[b, c]
        if rest.hinders[c, b] and not hinders(body, rest.segments[c], rest.segments[b]):
            rest.hinders[c, b] = False
            rest.waits[c] -= 1
