"""The skyline before a window: that of the sequence as far as it has been printed."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.nozzle import POINT, NozzleBody
from slicer.pieces import LEFT, RIGHT
from slicer.skyline import Skyline, new_skyline, with_laid


class Ground:
    """The skyline of a sequence as far as it has been printed."""

    def __init__(self, segments: NDArray[np.float64], body: NozzleBody = POINT) -> None:
        self._segments = segments
        self._sky = new_skyline(segments, body, 0)

    def print(self, oriented: NDArray[np.int32]) -> None:
        """Print the next toolpaths."""
        self._sky = _lay_all(self._sky, self._segments, oriented)

    def pieces(self) -> NDArray[np.float64]:
        """float64 (q, 4), the pieces [x left, y left, x right, y right] from left to right."""
        order = []
        at = int(self._sky.link[LEFT, RIGHT])
        while at != RIGHT:
            order.append(at)
            at = int(self._sky.link[at, RIGHT])
        return self._sky.piece[order].reshape(-1, 4)


@kernel
def _lay_all(sky: Skyline, segments: NDArray[np.float64], oriented: NDArray[np.int32]) -> Skyline:
    for u in oriented:
        sky = with_laid(sky, segments[u >> 1], -1)
    return sky
