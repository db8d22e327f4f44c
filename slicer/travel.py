"""What the nozzle really travels: straight where it can, else over what is already printed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import SlicerError
from slicer.kernels import kernel
from slicer.skyline import lay, new_skyline, overpass
from slicer.taut_string import EPS_MM


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
    segments: NDArray[np.float64], order: ArrayLike, flipped: ArrayLike, *, clearance_mm: float = 0.0
) -> Plan:
    """Route every travel of a printable sequence.

    A travel is straight unless that would take the nozzle below the skyline of printed material
    strictly inside its x-range. Otherwise it follows the taut string over the skyline, lifted by
    ``clearance_mm``: up from the toolpath's end, over, and down to the next one's start.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm.
        order: int (n,), the toolpath that is printed k-th; below before above.
        flipped: bool (n,), whether the k-th is printed from its second endpoint.

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
    via, via_start, routed = _routes(toolpaths, clearance_mm)
    return Plan(toolpaths, sequence, via, via_start, straight_mm(toolpaths), routed)


@kernel
def _routes(
    toolpaths: NDArray[np.float64], clearance: float
) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """Waypoints of all travels, where those of each begin, and the length of the travels."""
    n = len(toolpaths)
    piece, link = new_skyline(n)
    via = np.empty((n + 16, 2))
    via_start = np.zeros(n + 1, np.int64)
    hull = np.empty((4 * n + 8, 2))
    cursor, used = lay(piece, link, 0, 2, toolpaths[0])
    count = 0
    length = 0.0
    for k in range(1, n):
        start, end = toolpaths[k - 1, 1], toolpaths[k, 0]
        via_start[k] = count
        size, cursor = overpass(piece, link, cursor, start, end, hull)
        if count + size > len(via):
            wider = np.empty((2 * len(via) + size, 2))
            for t in range(count):
                wider[t, 0], wider[t, 1] = via[t, 0], via[t, 1]
            via = wider
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
        cursor, used = lay(piece, link, cursor, used, toolpaths[k])
    via_start[n] = count
    return via[:count].copy(), via_start, length
