"""What a sequence is optimised for: the objective, its limits, and what they are for the kernels."""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from slicer.errors import SequenceError
from slicer.nozzle import DOWNHILL_SLACK_DEG
from slicer.sequence.problem.checks import real_number, three_numbers

ObjectiveName = Literal["straight", "routed", "time"]

SMALLEST, LARGEST = 1e-6, 1e9
"""Bounds of speeds and accelerations, and the largest fixed time. Within them, and with coordinates within
``problem.REACH_MM``, no cost overflows or comes near ``FORBIDDEN``. Costs that are no numbers must not
reach the kernels, which sort by them and find cells of a grid with them, and do not check their indices.
"""
FARTHEST_MM = 1e5
"""Largest clearance: as far as coordinates reach."""


def is_timed(name: str) -> bool:
    """Whether an objective counts seconds; otherwise mm."""
    return name == "time"


def is_routed(name: str) -> bool:
    """Whether what is printed at the moment matters to an objective, since travels keep above it."""
    return name != "straight"


def unit_of(name: str) -> str:
    """The unit in which an objective counts."""
    return "s" if is_timed(name) else "mm"


class CostModel(NamedTuple):
    """How the kernels charge for a travel; an argument of compiled code.

    Attributes:
        timed: whether a travel costs seconds; otherwise its length in mm.
        clearance: how far a travel keeps above what is printed, in mm; 0 for straight travels.
        speed, speed_x, speed_y: limits of the path and of the axes, in mm/s.
        acceleration, acceleration_x, acceleration_y: the same, in mm/s².
        fixed: seconds of retraction or of the valve, for each travel longer than ``fixed_from`` mm.
        fixed_from: see ``fixed``.
        join: a direct hop of at most so many mm is extruded instead of travelled; 0 for none.
        join_speed: how fast the nozzle moves there, in mm/s.
        join_fall: how far such a hop may lead downwards for each mm of its way; infinite for any.
    """

    timed: bool
    clearance: float
    speed: float
    speed_x: float
    speed_y: float
    acceleration: float
    acceleration_x: float
    acceleration_y: float
    fixed: float
    fixed_from: float
    join: float
    join_speed: float
    join_fall: float


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
        join_mm: "time" counts a direct hop of at most this length as extruded: at ``join_speed_mm_s``,
            without stops and without ``fixed_s``; 0 for none.
        join_speed_mm_s: see ``join_mm``.
        join_downhill_deg: the steepest tilt, in degrees, at which such a hop may lead downwards.

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
    join_mm: float = 0.0
    join_speed_mm_s: float = 1.0
    join_downhill_deg: float = 90.0

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
            "join_mm": real_number("join_mm", self.join_mm, "Give 0 to join nothing.", 0.0, FARTHEST_MM),
            "join_speed_mm_s": real_number(
                "join_speed_mm_s", self.join_speed_mm_s, "Give the print speed.", SMALLEST, LARGEST
            ),
            "join_downhill_deg": real_number(
                "join_downhill_deg", self.join_downhill_deg, "Give 90 for any hop.", 0.0, 90.0
            ),
        }
        for field, value in clean.items():
            object.__setattr__(self, field, value)

    @property
    def unit(self) -> str:
        """The unit of its costs and bounds: "mm" or "s"."""
        return unit_of(self.name)

    def relaxes(self, other: "Objective") -> bool:
        """Whether no sequence costs more by this objective than by the other, so that its bounds hold there.

        A straight travel is never longer than the same travel over what is printed.
        """
        return self == other or (self.name == "straight" and other.name == "routed")

    @property
    def routed(self) -> bool:
        """Whether what is printed at the moment matters."""
        return is_routed(self.name)

    @property
    def timed(self) -> bool:
        """Whether it counts seconds."""
        return is_timed(self.name)

    @property
    def searched_as(self) -> ObjectiveName:
        """What methods search for first: of the same unit, by direct travels where they see no walls."""
        return "time" if self.timed else "straight"

    @property
    def _join_fall(self) -> float:
        steepest = self.join_downhill_deg + DOWNHILL_SLACK_DEG
        return float(np.sin(np.radians(steepest))) if steepest < 90.0 else np.inf

    @property
    def cost_model(self) -> CostModel:
        """What the kernels are given of it."""
        timed = self.timed
        return CostModel(
            timed,
            self.clearance_mm if self.routed else 0.0,
            *self.speed_mm_s,
            *self.acceleration_mm_s2,
            self.fixed_s if timed else 0.0,
            self.fixed_from_mm,
            self.join_mm if timed else 0.0,
            self.join_speed_mm_s,
            self._join_fall,
        )
