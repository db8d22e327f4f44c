"""What the axes and the motion planner of a machine allow, in the plane of the sheet."""

import math
import re
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

from dialect.flavor import MARLIN, Flavor
from profiles import Profile

SETTING = re.compile(r"([A-Z_]+)=([-+]?(?:\d+\.?\d*|\.\d+))")
WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")


@dataclass(frozen=True)
class AxisLimits:
    """Highest speed of each axis: along the sheet, upwards, across the sheet, and of the feed."""

    x_mm_s: float
    y_mm_s: float
    depth_mm_s: float
    e_mm_s: float

    @classmethod
    def of(cls, profile: Profile) -> Self:
        """The limits of a profile, in the plane in which its sheet stands."""
        return cls(*in_plane(profile.machine.max_speed_mm_s, profile.machine.plane))

    def slowed(self, speed_mm_s: float, dx: float, dy: float, e: float = 0.0) -> float:
        """The speed along (dx, dy) that no axis exceeds, nor the feed while it advances by ``e`` mm."""
        length = math.hypot(dx, dy)
        if length == 0:
            return speed_mm_s
        for part, limit in ((dx, self.x_mm_s), (dy, self.y_mm_s), (e, self.e_mm_s)):
            if part:
                speed_mm_s = min(speed_mm_s, limit * length / abs(part))
        return speed_mm_s


class PerAxis(NamedTuple):
    """A limit along the sheet, upwards, across the sheet, and of the feed."""

    x: float
    y: float
    depth: float
    e: float


def in_plane(xyze: tuple[float, float, float, float], plane: str) -> PerAxis:
    """A limit of X, Y, Z and E, for a sheet that stands in a plane "XZ" or "YZ"."""
    x, y, z, e = xyze
    return PerAxis(x, z, y, e) if plane == "XZ" else PerAxis(y, z, x, e)


@dataclass(frozen=True)
class Dynamics:
    """What a motion planner goes by: speeds in mm/s, accelerations in mm/s².

    Attributes:
        plane: "XZ" or "YZ", for the commands that name axes.
        speed, acceleration: the most that each axis can do (Marlin: M203, M201).
        printing, retracting, travelling: acceleration along the path, by what the move does
            (Marlin: M204 P, R, T).
        junction_deviation_mm: see Marlin's JUNCTION_DEVIATION_MM (M205 J).
    """

    plane: str
    speed: PerAxis
    acceleration: PerAxis
    printing: float
    retracting: float
    travelling: float
    junction_deviation_mm: float
    flavor: Flavor = MARLIN

    @classmethod
    def of(cls, profile: Profile) -> Self:
        """The limits of a profile."""
        machine, motion = profile.machine, profile.motion
        return cls(
            plane=machine.plane,
            speed=in_plane(machine.max_speed_mm_s, machine.plane),
            acceleration=in_plane(machine.max_acceleration_mm_s2, machine.plane),
            printing=motion.print_acceleration_mm_s2,
            retracting=motion.retract_acceleration_mm_s2,
            travelling=motion.travel_acceleration_mm_s2,
            junction_deviation_mm=machine.junction_deviation_mm,
            flavor=profile.flavor,
        )

    def after(self, command: str) -> Self:
        """The limits after a command: M201, M203, M204 and M205 change them where they are obeyed."""
        command = command.upper().partition(";")[0]
        code = command.split(maxsplit=1)[0] if command.strip() else ""
        if code not in self.flavor.limits:
            return self
        if code == "SET_VELOCITY_LIMIT":
            return self._klipper(dict(SETTING.findall(command)).get("ACCEL"))
        given = {letter: float(value) for letter, value in WORD.findall(command[len(code) :])}
        given = {letter: value for letter, value in given.items() if value > 0}
        match code:
            case "M201":
                return replace(self, acceleration=self._changed(self.acceleration, given))
            case "M203":
                given = {axis: value / self.flavor.axis_speed_per_s for axis, value in given.items()}
                return replace(self, speed=self._changed(self.speed, given))
            case "M204":
                if self.flavor.name == "klipper":  # one acceleration for all: S, or the lesser of P and T
                    lesser = min(given["P"], given["T"]) if given.keys() >= {"P", "T"} else None
                    return self._klipper(given.get("S", lesser))
                both = given.get("S")
                return replace(
                    self,
                    printing=given.get("P", both or self.printing),
                    retracting=given.get("R", self.retracting),
                    travelling=given.get("T", both or self.travelling),
                )
            case "M205":
                return replace(self, junction_deviation_mm=given.get("J", self.junction_deviation_mm))
            case _:  # jerk of RepRapFirmware, which the estimate takes from the profile
                return self

    def _klipper(self, acceleration: str | float | None) -> Self:
        """Klipper has one acceleration for everything but the feed alone."""
        if acceleration is None or not float(acceleration) > 0:
            return self
        return replace(self, printing=float(acceleration), travelling=float(acceleration))

    def _changed(self, limits: PerAxis, given: dict[str, float]) -> PerAxis:
        along, across = self.plane[0], "Y" if self.plane == "XZ" else "X"
        return PerAxis(*(given.get(a, old) for a, old in zip((along, "Z", across, "E"), limits, strict=True)))
