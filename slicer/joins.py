"""Hops between toolpaths over which the bead may go on, so that the feed need not stop."""

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from slicer import precedence
from slicer.cycles import components
from slicer.nozzle import NozzleBody, allowed_directions
from slicer.travel import STILL_MM

ALONG_MM = 0.02
"""A hop runs along a toolpath where it is no farther from it, if that is all of the hop,"""
ALONG_FROM_MM = 0.1
"""or so much of it and half of the shorter one: what it lays there lies on the toolpath's own bead. Hops that
leave a toolpath at a small angle soon come away from it.
"""


def joinable(
    segments: NDArray[np.float64],
    order: ArrayLike,
    flipped: ArrayLike,
    body: NozzleBody,
    join_mm: float,
    ends: NDArray[np.bool_] | None = None,
    downhill_deg: float = 90.0,
) -> NDArray[np.bool_]:
    """Which hops of a sequence may be extruded as far as what is printed after them goes.

    What a hop lays is material like any other: it must not lie above a toolpath that is still to be printed,
    nor stand in its way, nor cross one, nor be laid along one that has a bead of its own. Whether
    the straight way is free of what is printed before says ``travel.plan``.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        order: int (n,), the toolpath that is printed k-th.
        flipped: bool (n,), whether the k-th is printed from its second endpoint.
        body: the nozzle.
        join_mm: no longer hop is extruded; 0 for none.
        ends: bool (n, 2), whether endpoint [1] of toolpath [0] is an end of the fibre. A cut within one is
            none: hops from piece to piece of neighbours would fill the room between them. None where all are.
        downhill_deg: the steepest tilt at which the tip may move downwards while it extrudes.

    Returns:
        bool (n,): whether the hop to the k-th may be; never to the first.
    """
    sequence, flip = np.asarray(order, np.int64), np.asarray(flipped, np.intp)
    n = len(sequence)
    out = np.zeros(n, np.bool_)
    if n < 2 or join_mm <= 0:
        return out
    hops = np.stack([segments[sequence[:-1], 1 - flip[:-1]], segments[sequence[1:], flip[1:]]], axis=1)
    length = np.hypot(*(hops[:, 1] - hops[:, 0]).T)
    short = (length <= join_mm) & (length > precedence.EPS_MM)
    if ends is not None:
        short &= ends[sequence[:-1], 1 - flip[:-1]] & ends[sequence[1:], flip[1:]]
    short &= allowed_directions(hops, downhill_deg)[:, 0]
    asked = np.flatnonzero(short)
    asked = np.delete(asked, _over_toolpaths(segments, hops[asked]))
    start, toolpath = precedence.hindered(segments, hops[asked], body)
    place = np.empty(n, np.int64)
    place[sequence] = np.arange(n)
    hop = np.repeat(asked, np.diff(start))
    out[asked + 1] = True
    out[hop[place[toolpath] > hop] + 1] = False
    return out


def fewest_beads(segments: NDArray[np.float64], join_mm: float, ends: NDArray[np.bool_] | None = None) -> int:
    """How many beads any order of toolpaths makes at least.

    A bead begins and ends where an end of a toolpath is joined to no other one. Each end is joined to at most
    one: where ends hang together by hops that may be extruded, one of an odd number of them is left over.

    Args:
        segments, join_mm, ends: as for ``joinable``.
    """
    n = len(segments)
    if n == 0:
        return 0
    place = np.asarray(segments, np.float64).reshape(-1, 2)
    points = shapely.points(place)
    a, b = shapely.STRtree(points).query(points, predicate="dwithin", distance=max(join_mm, STILL_MM))
    apart = (a < b) & (a // 2 != b // 2)
    a, b = a[apart], b[apart]
    hops = np.stack([place[a], place[b]], axis=1)
    length = np.hypot(*(hops[:, 1] - hops[:, 0]).T)
    meets = length <= STILL_MM
    may = ~meets & (length <= join_mm)
    if ends is not None:
        may &= ends.reshape(-1)[a] & ends.reshape(-1)[b]
    asked = np.flatnonzero(may)
    may[asked[_over_toolpaths(segments, hops[asked])]] = False
    pairs = np.stack([a, b], axis=1)[meets | may]
    edges = np.concatenate([pairs, pairs[:, ::-1]]).astype(np.int32)
    group, bead = components(2 * n, edges), components(n, edges // 2)
    _, first = np.unique(group, return_index=True)
    odd = np.bincount(bead[first // 2], np.bincount(group) % 2)
    # Toolpaths that hang together by hops are one bead at least; they have an even number of ends.
    return int(np.maximum(odd // 2, 1).sum())


def _over_toolpaths(segments: NDArray[np.float64], hops: NDArray[np.float64]) -> NDArray[np.intp]:
    """The places of the hops (q, 2, 2) that cross a toolpath, or run along one."""
    lines = shapely.linestrings(segments)
    tree, ways = shapely.STRtree(lines), shapely.linestrings(hops)
    crossing, _ = tree.query(ways, predicate="crosses")
    over, near = tree.query(ways, predicate="dwithin", distance=ALONG_MM)
    way, own = hops[over, 1] - hops[over, 0], segments[near, 1] - segments[near, 0]
    # Beside another line by that much for so long, neither can be steep to the other.
    cross = way[:, 0] * own[:, 1] - way[:, 1] * own[:, 0]
    flat = np.abs(cross) <= 2 * ALONG_MM / ALONG_FROM_MM * np.hypot(*way.T) * np.hypot(*own.T)
    over, near = over[flat], near[flat]
    beside = shapely.length(shapely.intersection(ways[over], shapely.buffer(lines[near], ALONG_MM)))
    shorter = np.minimum(np.hypot(*way.T), np.hypot(*own.T))[flat]
    over = over[(beside > ALONG_FROM_MM) & (beside > 0.5 * shorter)]
    hop, toolpath = tree.query(shapely.points(hops.mean(axis=1)), predicate="dwithin", distance=ALONG_MM)
    ends = shapely.distance(shapely.points(hops[hop]), lines[toolpath][:, None])
    return np.unique(np.concatenate([crossing, over, hop[(ends <= ALONG_MM).all(axis=1)]]))
