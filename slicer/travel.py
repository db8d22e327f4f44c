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


@dataclass(frozen=True, eq=False)
class Plan:
    """A sequence together with the route of every travel.

    Attributes:
        toolpaths: float64 (n, 2, 2), the k-th printed from ``[k, 0]`` to ``[k, 1]``, in mm.
        order: int64 (n,), the index of the k-th in the segments it came from.
        via: float64 (p, 2), the waypoints of all routes.
        via_start: int64 (n + 1,); on the way to the k-th toolpath the nozzle passes
            ``via[via_start[k]:via_start[k + 1]]``. Nothing for k = 0.
        straight_mm: straight travel J.
        routed_mm: length of the routes.
    """

    toolpaths: NDArray[np.float64]
    order: NDArray[np.int64]
    via: NDArray[np.float64]
    via_start: NDArray[np.int64]
    straight_mm: float
    routed_mm: float

    @property
    def printed_mm(self) -> float:
        """Length of all toolpaths."""
        return float(np.hypot(*(self.toolpaths[:, 1] - self.toolpaths[:, 0]).T).sum())


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
) -> Plan:
    """Route every travel of a printable sequence.

    A travel is straight unless that would take the nozzle below the skyline of printed material
    strictly inside its x-range. Otherwise it follows the taut string over the skyline, lifted by
    ``clearance_mm``: up from the toolpath's end, over, and down to the next one's start. With a body, the
    skyline is that of everything that stands in its way (``slicer.skyline``), but for what a tip that
    leaves the lower end of a toolpath has of its rise in the body already.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm.
        order: int (n,), the toolpath that is printed k-th; below before above.
        flipped: bool (n,), whether the k-th is printed from its second endpoint.
        body: the nozzle, under which the sequence is printable.

    Raises:
        SlicerError: a negative clearance.
    """
    if not clearance_mm >= 0:
        raise SlicerError(f"clearance_mm {clearance_mm:g} must be at least 0")
    sequence, flip = np.asarray(order, np.int64), np.asarray(flipped, np.intp)
    toolpaths = np.ascontiguousarray(
        np.stack([segments[sequence, flip], segments[sequence, 1 - flip]], axis=1), np.float64
    ).reshape(-1, 2, 2)
    if len(toolpaths) == 0:
        return Plan(toolpaths, sequence, np.empty((0, 2)), np.zeros(1, np.int64), 0.0, 0.0)
    doublings, routed = 0, NO_ROOM
    while routed < 0:
        via, via_start, routed = _routes(toolpaths, clearance_mm, body, doublings)
        doublings += 1
    return Plan(toolpaths, sequence, via, via_start, straight_mm(toolpaths), routed)


@kernel
def _routes(
    toolpaths: NDArray[np.float64], clearance: float, body: NozzleBody, doublings: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """Waypoints of all travels, where those of each begin, and the length of the travels; ``NO_ROOM`` for it
    where the skyline needs more room.
    """
    n = len(toolpaths)
    sky = new_skyline(toolpaths, body, doublings)
    via = np.empty((n + 16, 2))
    via_start = np.zeros(n + 1, np.int64)
    k, length = 1, 0.0
    while True:
        k, length = _route(sky, toolpaths, clearance, via, via_start, k, length)
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
        length += np.hypot(end[0] - here_x, end[1] - here_y)
        if not point and not lay(sky, toolpaths[k - 1]):
            return k, NO_ROOM
    via_start[len(toolpaths)] = count
    return len(toolpaths), length
