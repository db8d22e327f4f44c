"""What a travel costs: its length, or the seconds that the machine's axes need for it."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from slicer.errors import SequenceError
from slicer.kernels import bare_kernel
from slicer.sequence.checks import real_number, three_numbers
from slicer.skyline import EPS_MM

FORBIDDEN = 1e30
"""Cost of what must not be."""

ObjectiveName = Literal["straight", "routed", "time"]

SMALLEST, LARGEST = 1e-6, 1e9
"""Bounds of speeds and accelerations, and the largest fixed time. Within them, and with coordinates within
``problem.REACH_MM``, no cost overflows or comes near ``FORBIDDEN``. Costs that are no numbers must not
reach the kernels, which sort by them and find cells of a grid with them, and do not check their indices.
"""
FARTHEST_MM = 1e5
"""Largest clearance: as far as coordinates reach."""


@dataclass(frozen=True)
class Objective:
    """What a sequence is optimised for.

    Attributes:
        name: "straight" is the paper's J, "routed" the length of the travels as they are made over what
            is printed, "time" the seconds of those travels.
        clearance_mm: how far a routed travel keeps above what is printed ("routed" and "time").
        speed_mm_s: travel speed, and the limits of the sheet's x and y axis.
        acceleration_mm_s2: travel acceleration, and the limits of the sheet's x and y axis.
        fixed_s: time of retraction or of the valve, for each travel longer than ``fixed_from_mm``.
        fixed_from_mm: see ``fixed_s``.

    Raises:
        SequenceError: there is no such objective; or a number is none, or outside its bounds. Speeds are
            finite; an acceleration may be infinite, for a machine that needs no time to speed up.
    """

    name: ObjectiveName = "straight"
    clearance_mm: float = 0.0
    speed_mm_s: tuple[float, float, float] = (1.0, 1.0, 1.0)
    acceleration_mm_s2: tuple[float, float, float] = (np.inf, np.inf, np.inf)
    fixed_s: float = 0.0
    fixed_from_mm: float = 0.0

    def __post_init__(self) -> None:
        names = get_args(ObjectiveName)
        if not isinstance(self.name, str) or self.name not in names:
            raise SequenceError(f"there is no objective '{self.name}'; there are {', '.join(names)}")
        clean = {
            "clearance_mm": real_number(
                "clearance_mm", self.clearance_mm, "Give 0 for no clearance.", 0.0, FARTHEST_MM
            ),
            "speed_mm_s": three_numbers(
                "speed_mm_s", self.speed_mm_s, "Give the limits of the machine.", SMALLEST, LARGEST
            ),
            "acceleration_mm_s2": three_numbers(
                "acceleration_mm_s2",
                self.acceleration_mm_s2,
                "Give the limits of the machine, or inf for no limit.",
                SMALLEST,
                np.inf,
            ),
            "fixed_s": real_number("fixed_s", self.fixed_s, "Give 0 for no fixed time.", 0.0, LARGEST),
            "fixed_from_mm": real_number(
                "fixed_from_mm", self.fixed_from_mm, "Give 0 for every travel.", 0.0, np.inf
            ),
        }
        for field, value in clean.items():
            object.__setattr__(self, field, value)

    @property
    def routed(self) -> bool:
        """Whether what is printed at the moment matters."""
        return self.name != "straight"

    def parameters(self) -> NDArray[np.float64]:
        """float64 (10,) for the kernels: timed, clearance, v, vx, vy, a, ax, ay, fixed, fixed from."""
        timed = self.name == "time"
        return np.array(
            [
                timed,
                self.clearance_mm if self.routed else 0.0,
                *self.speed_mm_s,
                *self.acceleration_mm_s2,
                self.fixed_s if timed else 0.0,
                self.fixed_from_mm,
            ],
            np.float64,
        )


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
def surely_dearer(
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
