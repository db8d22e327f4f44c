"""What a travel costs: its length, or the seconds that the machine's axes need for it."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.skyline import EPS_MM

FORBIDDEN = 1e30
"""Cost of what must not be."""


@bare_kernel
def leg_cost(parameters: NDArray[np.float64], dx: float, dy: float) -> float:
    """Cost of one straight leg by (dx, dy) mm: its length in mm, or its time in s.

    The time is that of a trapezoidal speed profile from rest to rest, along the leg, under the limits
    of path and axes: speed up with a, hold v, slow down with a; 2·√(L/a) where v is never reached.
    """
    length = float(np.sqrt(dx * dx + dy * dy))
    if parameters[0] == 0.0:
        return length
    if length <= EPS_MM:  # rounding; the root of even 1e-16 mm would be time
        return 0.0
    ux, uy = abs(dx) / length, abs(dy) / length
    v, a = parameters[2], parameters[5]
    if ux > 0.0:
        v, a = min(v, parameters[3] / ux), min(a, parameters[6] / ux)
    if uy > 0.0:
        v, a = min(v, parameters[4] / uy), min(a, parameters[7] / uy)
    if length * a < v * v:
        return float(2.0 * np.sqrt(length / a))
    return float(length / v + v / a)


@bare_kernel
def direct_cost(parameters: NDArray[np.float64], dx: float, dy: float) -> float:
    """Cost of a travel by (dx, dy) mm that nothing is in the way of, the fixed time included."""
    cost = leg_cost(parameters, dx, dy)
    if parameters[8] > 0.0 and dx * dx + dy * dy > max(parameters[9], EPS_MM) ** 2:
        cost += parameters[8]
    return cost


@bare_kernel
def arc_cost(points: NDArray[np.float64], parameters: NDArray[np.float64], u: int, v: int) -> float:
    """Cost of the direct travel from the end of oriented toolpath ``u`` to the entry of ``v``.

    ``points`` is float64 (2n, 2), the entry of each oriented toolpath. A negative ``v`` stands for the
    end of the sequence and costs nothing. A negative ``u`` stands before the first toolpath: -1 costs
    nothing, -2 forbids to begin with a flipped toolpath and -3 with one that is not.
    """
    if v < 0:
        return 0.0
    if u < 0:
        return 0.0 if u == -1 or (v & 1) == -2 - u else FORBIDDEN
    return direct_cost(parameters, points[v, 0] - points[u ^ 1, 0], points[v, 1] - points[u ^ 1, 1])


@bare_kernel
def costs_at_least(
    points: NDArray[np.float64], parameters: NDArray[np.float64], u: int, v: int, most: float
) -> bool:
    """Whether the direct travel from ``u`` to ``v`` costs at least ``most``, as far as that is cheap to tell.

    No travel of length L takes less than L / v, so that no root has to be drawn.
    """
    if u < 0 or v < 0:
        return most <= 0.0
    if parameters[0] != 0.0:
        most *= parameters[2]
    dx, dy = points[v, 0] - points[u ^ 1, 0], points[v, 1] - points[u ^ 1, 1]
    return most <= 0.0 or dx * dx + dy * dy >= most * most


@bare_kernel
def direct_sum(
    segments: NDArray[np.float64], parameters: NDArray[np.float64], oriented: NDArray[np.int32]
) -> float:
    """The cost of a sequence whose travels are all straight."""
    total = 0.0
    for k in range(1, len(oriented)):
        u, v = oriented[k - 1], oriented[k]
        dx = segments[v >> 1, v & 1, 0] - segments[u >> 1, 1 - (u & 1), 0]
        dy = segments[v >> 1, v & 1, 1] - segments[u >> 1, 1 - (u & 1), 1]
        total += direct_cost(parameters, dx, dy)
    return total
