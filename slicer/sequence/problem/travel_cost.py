"""What a travel costs: its length, or the seconds that the machine's axes need for it."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.problem.objective import CostModel
from slicer.taut_string import EPS_MM

FORBIDDEN = 1e30
"""Cost of what must not be."""


@bare_kernel
def leg_cost(cost_model: CostModel, dx: float, dy: float) -> float:
    """Cost of one straight leg by (dx, dy) mm: its length in mm, or its time in s.

    The time is that of a trapezoidal speed profile from rest to rest, along the leg, under the limits
    of path and axes: speed up with a, hold v, slow down with a; 2·√(L/a) where v is never reached.
    """
    length = float(np.sqrt(dx * dx + dy * dy))
    if not cost_model.timed:
        return length
    if length <= EPS_MM:  # rounding; the root of even 1e-16 mm would be time
        return 0.0
    ux, uy = abs(dx) / length, abs(dy) / length
    v, a = cost_model.speed, cost_model.acceleration
    if ux > 0.0:
        v, a = min(v, cost_model.speed_x / ux), min(a, cost_model.acceleration_x / ux)
    if uy > 0.0:
        v, a = min(v, cost_model.speed_y / uy), min(a, cost_model.acceleration_y / uy)
    if length * a < v * v:
        return float(2.0 * np.sqrt(length / a))
    return float(length / v + v / a)


def least_cost_per_mm(cost_model: CostModel) -> float:
    """What a millimetre along x costs at least, in mm or s; lower bounds are false where a travel costs less.

    No travel takes less than its length along x at full speed.
    """
    return 1.0 / min(_fastest(cost_model), cost_model.speed_x) if cost_model.timed else 1.0


@bare_kernel
def _fastest(cost_model: CostModel) -> float:
    """No nozzle is faster between toolpaths, in mm/s."""
    return max(cost_model.speed, cost_model.join_speed) if cost_model.join > 0.0 else cost_model.speed


@bare_kernel
def direct_cost(cost_model: CostModel, dx: float, dy: float) -> float:
    """Cost of a travel by (dx, dy) mm that nothing is in the way of, the fixed time included.

    A short hop over which the bead goes on costs the time of laying it: the nozzle neither stops nor starts.
    """
    squared = dx * dx + dy * dy
    if squared <= cost_model.join**2 and cost_model.timed and squared > EPS_MM**2:
        length = float(np.sqrt(squared))
        if -dy <= cost_model.join_fall * length:
            return max(
                length / cost_model.join_speed,
                abs(dx) / cost_model.speed_x,
                abs(dy) / cost_model.speed_y,
            )
    cost = leg_cost(cost_model, dx, dy)
    if cost_model.fixed > 0.0 and squared > max(cost_model.fixed_from, EPS_MM) ** 2:
        cost += cost_model.fixed
    return cost


@bare_kernel
def least_travel_cost(cost_model: CostModel, dx: float, dy: float) -> float:
    """No travel by (dx, dy) mm costs less, whatever is in its way; what bounds must price it at.

    A hop that has to rise over something is not joined, and where beads are laid slowly that is quicker.
    """
    cost = direct_cost(cost_model, dx, dy)
    if cost_model.timed and dx * dx + dy * dy <= cost_model.join**2:
        apart = leg_cost(cost_model, dx, dy)
        if cost_model.fixed > 0.0 and dx * dx + dy * dy > max(cost_model.fixed_from, EPS_MM) ** 2:
            apart += cost_model.fixed
        cost = min(cost, apart)
    return cost


@inner_kernel
def arc_cost(points: NDArray[np.float64], cost_model: CostModel, u: int, v: int) -> float:
    """Cost of the direct travel from the end of oriented toolpath ``u`` to the entry of ``v``.

    ``points`` is float64 (2n, 2), the entry of each oriented toolpath. A negative ``v`` stands for the
    end of the sequence and costs nothing. A negative ``u`` stands before the first toolpath: -1 costs
    nothing, -2 forbids to begin with a flipped toolpath and -3 with one that is not.
    """
    if v < 0:
        return 0.0
    if u < 0:
        return 0.0 if u == -1 or (v & 1) == -2 - u else FORBIDDEN
    return direct_cost(cost_model, points[v, 0] - points[u ^ 1, 0], points[v, 1] - points[u ^ 1, 1])


@inner_kernel
def costs_at_least(points: NDArray[np.float64], cost_model: CostModel, u: int, v: int, most: float) -> bool:
    """Whether the direct travel from ``u`` to ``v`` costs at least ``most``, as far as that is cheap to tell.

    No travel of length L takes less than L / v, so that no root has to be drawn.
    """
    if u < 0 or v < 0:
        return most <= 0.0
    if cost_model.timed:
        most *= _fastest(cost_model)
    dx, dy = points[v, 0] - points[u ^ 1, 0], points[v, 1] - points[u ^ 1, 1]
    return most <= 0.0 or dx * dx + dy * dy >= most * most


@bare_kernel
def direct_sum(segments: NDArray[np.float64], cost_model: CostModel, oriented: NDArray[np.int32]) -> float:
    """The cost of a sequence whose travels are all straight."""
    total = 0.0
    for k in range(1, len(oriented)):
        u, v = oriented[k - 1], oriented[k]
        dx = segments[v >> 1, v & 1, 0] - segments[u >> 1, 1 - (u & 1), 0]
        dy = segments[v >> 1, v & 1, 1] - segments[u >> 1, 1 - (u & 1), 1]
        total += direct_cost(cost_model, dx, dy)
    return total
