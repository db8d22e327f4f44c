"""The skyline before a window: that of the sequence as far as it has been printed."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.skyline import LEFT, RIGHT, lay, new_skyline


class Ground:
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
