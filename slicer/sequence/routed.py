"""What a whole sequence costs when its travels keep above what is printed."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.cost import direct_cost, leg_cost
from slicer.skyline import EPS_MM, LEFT, RIGHT, lay, new_skyline, overpass


@kernel
def routed_sum(
    segments: NDArray[np.float64], parameters: NDArray[np.float64], oriented: NDArray[np.int32]
) -> float:
    """The cost of a printable sequence, its travels routed as ``slicer.travel.plan`` does, mm or s."""
    n = len(oriented)
    piece, link = new_skyline(n)
    hull = np.empty((4 * n + 8, 2))
    total = 0.0
    cursor, used = LEFT, 2
    for k in range(n):
        s, f = oriented[k] >> 1, oriented[k] & 1
        if k > 0:
            before = oriented[k - 1]
            start, end = segments[before >> 1, 1 - (before & 1)], segments[s, f]
            size, cursor = overpass(piece, link, cursor, start, end, hull)
            total += string_cost(parameters, start, end, hull, size)
        cursor, used = lay(piece, link, cursor, used, segments[s])
    return total


@kernel
def string_cost(
    parameters: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    hull: NDArray[np.float64],
    size: int,
) -> float:
    """The cost of a travel along the taut string that ``overpass`` left in ``hull``, lifted."""
    if size == 0:
        return direct_cost(parameters, end[0] - start[0], end[1] - start[1])
    length, cost = 0.0, 0.0
    here_x, here_y = start[0], start[1]
    for t in range(size + 1):
        x, y = end[0], end[1]
        if t < size:
            x, y = hull[t, 0], hull[t, 1] + parameters[1]
            if np.hypot(x - end[0], y - end[1]) <= EPS_MM or np.hypot(x - here_x, y - here_y) <= EPS_MM:
                continue
        length += np.hypot(x - here_x, y - here_y)
        cost += leg_cost(parameters, x - here_x, y - here_y)
        here_x, here_y = x, y
    if parameters[8] > 0.0 and length > parameters[9]:
        cost += parameters[8]
    return cost


class Horizon:
    """The skyline of a sequence as far as it has been printed."""

    def __init__(self, segments: NDArray[np.float64]) -> None:
        self._segments = segments
        self._piece, self._link = new_skyline(len(segments))
        self._cursor, self._used = LEFT, 2

    def print(self, oriented: NDArray[np.int32]) -> None:
        """Print the next toolpaths."""
        self._cursor, self._used = _lay_all(
            self._piece, self._link, self._cursor, self._used, self._segments, oriented
        )

    def pieces(self) -> NDArray[np.float64]:
        """float64 (q, 4), the pieces [x left, y left, x right, y right] from left to right."""
        order = []
        at = int(self._link[LEFT, RIGHT])
        while at != RIGHT:
            order.append(at)
            at = int(self._link[at, RIGHT])
        return self._piece[order].reshape(-1, 4)


@kernel
def _lay_all(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    cursor: int,
    used: int,
    segments: NDArray[np.float64],
    oriented: NDArray[np.int32],
) -> tuple[int, int]:
    for u in oriented:
        cursor, used = lay(piece, link, cursor, used, segments[u >> 1])
    return cursor, used
