"""Fibre angles, which have no direction: folded into (-90, 90], and doubted where they look wrong."""

import math

import numpy as np
from numpy.typing import NDArray

MOST_DEG = 180.0
LEAST_RADIANS = 0.75
"""A field of radians that stays below this is nearly level, and so is one of degrees: not worth a word."""


def fold(angles_deg: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[str]]:
    """Angles in (-90, 90] that stand for the same fibres, and a line for what looks like a mistake.

    Fibres at -90 and at 90 degrees, or at 180 and 0, are the same. Angles beyond ±180 degrees are said,
    and so are those that seem to be radians: no more than pi/2, as much as ``LEAST_RADIANS``, and of two
    or more values that are no whole numbers.

    Args:
        angles_deg: float64 (rows, cols), NaN for empty tiles.
    """
    said = []
    beyond = np.argwhere(np.abs(angles_deg) > MOST_DEG)
    folded = np.array([[_fold(angle) for angle in row] for row in angles_deg.tolist()], np.float64)
    if len(beyond):
        row, col = beyond[0].tolist()
        more = f"; {len(beyond) - 1} more are beyond it" if len(beyond) > 1 else ""
        said.append(
            f"angles_deg[{row}][{col}]: tile ({col}, {row}): angle {angles_deg[row, col]:g} is beyond "
            f"±{MOST_DEG:g} and was taken as {folded[row, col]:g}{more}. Degrees or radians?"
        )
    there = angles_deg[~np.isnan(angles_deg)]
    most = float(np.abs(there).max(initial=0.0))
    broken = np.unique(there[there != np.round(there)])
    if LEAST_RADIANS <= most <= math.pi / 2 + 1e-6 and len(broken) > 1:
        said.append(
            f"angles_deg: all {len(there)} angles lie within ±{most:g}, as radians do (±{math.pi / 2:.4f}), "
            "and were taken as degrees. Degrees or radians?"
        )
    return folded, said


def _fold(angle: float) -> float:
    if math.isnan(angle) or -90 < angle <= 90:
        return angle + 0.0  # no negative zero
    folded = math.remainder(angle, 180.0)
    return 90.0 if folded == -90.0 else folded + 0.0
