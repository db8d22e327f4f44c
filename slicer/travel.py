"""What the nozzle really travels: straight where it can, else over what is already printed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import SlicerError
from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import POINT, NozzleBody
from slicer.skyline import Skyline, lay, lay_to_leave, new_skyline, overpass, replace
from slicer.taut_string import EPS_MM

NO_ROOM = -1.0
STILL_MM = 1e-6
"""A hop that is shorter is none: the next toolpath begins where the last one ended."""

TRAVELLED, MAY_JOIN, JOINED = range(3)
"""What becomes of the hop to a toolpath."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A sequence together with the route of every travel.

    Attributes:
        toolpaths: float64 (n, 2, 2), the k-th printed from ``[k, 0]`` to ``[k, 1]``, in mm.
        order: int64 (n,), the index of the k-th in the segments it came from.
        via: float64 (p, 2), the waypoints of all routes.
        via_start: int64 (n + 1,); on the way to the k-th toolpath the nozzle passes
            ``via[via_start[k]:via_start[k + 1]]``. Nothing for k = 0.
        joined: bool (n,), whether the hop to the k-th is extruded: the bead goes on.
        straight_mm: straight travel J, over hops that are extruded too, as the source paper counts.
        routed_mm: length of the routes of what is travelled.
        joined_mm: length of the hops that are extruded.
    """

    toolpaths: NDArray[np.float64]
    order: NDArray[np.int64]
    via: NDArray[np.float64]
    via_start: NDArray[np.int64]
    joined: NDArray[np.bool_]
    straight_mm: float
    routed_mm: float
    joined_mm: float = 0.0

    @property
    def printed_mm(self) -> float:
        """Length of all toolpaths."""
        return float(np.hypot(*(self.toolpaths[:, 1] - self.toolpaths[:, 0]).T).sum())

    @property
    def beads(self) -> int:
        """How often material begins to flow: toolpaths that follow one another without a gap are one bead."""
        if len(self.toolpaths) == 0:
            return 0
        gap = np.hypot(*(self.toolpaths[1:, 0] - self.toolpaths[:-1, 1]).T) > STILL_MM
        return 1 + int((gap & ~self.joined[1:]).sum())


def straight_mm(toolpaths: NDArray[np.float64]) -> float:
    """Straight travel J of toolpaths (n, 2, 2) printed in their order from [0] to [1], in mm."""
    return float(np.hypot(*(toolpaths[1:, 0] - toolpaths[:-1, 1]).T).sum())


def plan(
    segments: NDArray[np.float64],
    order: ArrayLike,
    flipped: ArrayLike,
    *,
    clearance_mm: float = 0.0,
    body: NozzleBody = POINT,
    join_mm: float = 0.0,
    ends: NDArray[np.bool_] | None = None,
    laid: NDArray[np.float64] | None = None,
    downhill_deg: float = 90.0,
) -> Plan:
    """Route every travel of a printable sequence.

    A travel is straight unless that would take the nozzle below the skyline of printed material
    strictly inside its x-range. Otherwise it follows the taut string over the skyline, lifted by
    ``clearance_mm``: up from the toolpath's end, over, and down to the next one's start. With a body, the
    skyline is that of everything that stands in its way (``slicer.skyline``), but for what a tip that
    leaves the lower end of a toolpath has of its rise in the body already.

    A hop of at most ``join_mm`` whose straight way is free, and which would hinder nothing that comes later,
    is extruded. What it lays is in the skyline from then on.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm.
        order: int (n,), the toolpath that is printed k-th; below before above.
        flipped: bool (n,), whether the k-th is printed from its second endpoint.
        body: the nozzle, under which the sequence is printable.
        join_mm: the longest hop that is extruded; 0 for none.
        ends: see ``joins.joinable``.
        laid: float (n, 2, 2), the segments as they are laid, where pieces of toolpaths overlap.
        downhill_deg: the steepest tilt at which a hop that is extruded may lead downwards.

    Raises:
        SlicerError: a negative clearance.
    """
    if not clearance_mm >= 0:
        raise SlicerError(f"clearance_mm {clearance_mm:g} must be at least 0")
    sequence, flip = np.asarray(order, np.int64), np.asarray(flipped, np.intp)
    printed = segments if laid is None else laid
    toolpaths = np.ascontiguousarray(
        np.stack([printed[sequence, flip], printed[sequence, 1 - flip]], axis=1), np.float64
    ).reshape(-1, 2, 2)
    if len(toolpaths) == 0:
        return Plan(toolpaths, sequence, np.empty((0, 2)), np.zeros(1, np.int64), np.empty(0, bool), 0.0, 0.0)
    may_join = np.zeros(len(toolpaths), np.bool_)
    if join_mm > 0:
        from slicer.joins import joinable

        may_join = joinable(segments, sequence, flip, body, join_mm, ends, downhill_deg)
    # Of a point nozzle the room is never too small: joins take as much again.
    doublings, routed = int(may_join.any()), NO_ROOM
    while routed < 0:
        hops = np.where(may_join, MAY_JOIN, TRAVELLED).astype(np.int8)
        via, via_start, routed = _routes(toolpaths, hops, clearance_mm, body, doublings)
        doublings += 1
    joined = hops == JOINED
    hop_mm = np.hypot(*(toolpaths[1:, 0] - toolpaths[:-1, 1]).T)
    straight, joined_mm = straight_mm(toolpaths), float(hop_mm[joined[1:]].sum())
    return Plan(toolpaths, sequence, via, via_start, joined, straight, routed, joined_mm)


@kernel
def _routes(
    toolpaths: NDArray[np.float64],
    hops: NDArray[np.int8],
    clearance: float,
    body: NozzleBody,
    doublings: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """Waypoints of all travels, where those of each begin, and the length of the travels; ``NO_ROOM`` for it
    where the skyline needs more room. Those of ``hops`` that may be joined and are become ``JOINED``.
    """
    n = len(toolpaths)
    sky = new_skyline(toolpaths, body, doublings)
    via = np.empty((n + 16, 2))
    via_start = np.zeros(n + 1, np.int64)
    k, length = 1, 0.0
    while True:
        k, length = _route(sky, toolpaths, hops, clearance, via, via_start, k, length)
        if k == n or length == NO_ROOM:
            break
        count = via_start[k]
        wider = np.empty((2 * len(via) + len(sky.hull), 2))
        for t in range(count):
            wider[t, 0], wider[t, 1] = via[t, 0], via[t, 1]
        via = wider
    return via[: via_start[n]].copy(), via_start, length


@inner_kernel
def _route(
    sky: Skyline,
    toolpaths: NDArray[np.float64],
    hops: NDArray[np.int8],
    clearance: float,
    via: NDArray[np.float64],
    via_start: NDArray[np.int64],
    first: int,
    length: float,
) -> tuple[int, float]:
    """Go on at the travel to toolpath ``first``: the travel for which ``via`` is too short, and the length
    so far. Where nothing is allocated, no references are counted, which takes as long as all else.
    """
    hull, point = sky.hull, sky.body.half_width == 0.0
    count = via_start[first]
    for k in range(first, len(toolpaths)):
        start, end = toolpaths[k - 1, 1], toolpaths[k, 0]
        if k == first and k > 1:  # it has been laid
            pass
        elif point:
            replace(sky.piece, sky.link, sky.place, toolpaths[k - 1])
        elif not lay_to_leave(sky, toolpaths[k - 1], 1):
            return k, NO_ROOM
        via_start[k] = count
        size = overpass(sky.piece, sky.link, sky.place, hull, start, end)
        if count + size > len(via):
            return k, length
        if size == 0 and hops[k] == MAY_JOIN:
            hops[k] = JOINED
        else:
            length, count = _follow(hull, size, clearance, via, count, (start, end), length)
        if not point and not lay(sky, toolpaths[k - 1]):
            return k, NO_ROOM
        if hops[k] == JOINED:
            hull[0, 0], hull[0, 1], hull[1, 0], hull[1, 1] = start[0], start[1], end[0], end[1]
            if not lay(sky, hull[:2]):
                return k, NO_ROOM
    via_start[len(toolpaths)] = count
    return len(toolpaths), length


@inner_kernel
def _follow(
    hull: NDArray[np.float64],
    size: int,
    clearance: float,
    via: NDArray[np.float64],
    count: int,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    length: float,
) -> tuple[float, int]:
    """Write down the waypoints of one travel: the length with it, and how many waypoints there are."""
    start, end = ends
    here_x, here_y = start[0], start[1]
    for t in range(size):
        x, y = hull[t, 0], hull[t, 1] + clearance
        # Start and end are on the string; without clearance they are no waypoints of their own.
        step = np.hypot(x - here_x, y - here_y)
        if step <= EPS_MM or np.hypot(x - end[0], y - end[1]) <= EPS_MM:
            continue
        via[count, 0], via[count, 1] = x, y
        count += 1
        length += step
        here_x, here_y = x, y
    return length + float(np.hypot(end[0] - here_x, end[1] - here_y)), count
