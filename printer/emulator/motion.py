"""How fast the emulated printer's axes move, and how it passes from one move to the next.

The shape of Marlin's planner (bugfix-2.1.x): a trapezoid for each block, junction deviation between them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

PerAxis = tuple[float, float, float, float]


@dataclass(frozen=True)
class Motion:
    """Limits of X, Y, Z and E in mm/s and mm/s², as Marlin comes, and those of M204 P, R and T; how long one
    or two moves after a stop wait for more."""

    speed_mm_s: PerAxis = (300.0, 300.0, 5.0, 25.0)
    acceleration_mm_s2: PerAxis = (3000.0, 3000.0, 100.0, 10000.0)
    print_mm_s2: float = 3000.0
    retract_mm_s2: float = 3000.0
    travel_mm_s2: float = 3000.0
    junction_deviation_mm: float = 0.013
    retract_mm: float = 3.0  # of G10 and G11
    retract_speed_mm_s: float = 45.0
    start_delay_s: float = 0.1

    def told(self, code: str, words: dict[str, float | None]) -> Self:
        """The limits after M201, M203, M204 or M205."""
        given = {letter: value for letter, value in words.items() if value}
        match code:
            case "M201":
                return replace(self, acceleration_mm_s2=_changed(self.acceleration_mm_s2, given))
            case "M203":
                return replace(self, speed_mm_s=_changed(self.speed_mm_s, given))
            case "M204":
                both = given.get("S")
                return replace(
                    self,
                    print_mm_s2=given.get("P", both or self.print_mm_s2),
                    retract_mm_s2=given.get("R", self.retract_mm_s2),
                    travel_mm_s2=given.get("T", both or self.travel_mm_s2),
                )
        return replace(self, junction_deviation_mm=given.get("J", self.junction_deviation_mm))


def _changed(limits: PerAxis, given: dict[str, float]) -> PerAxis:
    x, y, z, e = (given.get(axis, old) for axis, old in zip("XYZE", limits, strict=True))
    return x, y, z, e


class Segment:
    """A straight move as the planner sees it: how long, in which direction, how fast at most."""

    __slots__ = ("acceleration", "direction", "entry_limit", "length", "nominal")

    def __init__(self, delta: Sequence[float], speed_mm_s: float, motion: Motion) -> None:
        x, y, z, e = delta
        path = math.sqrt(x * x + y * y + z * z)
        self.length = path or abs(e)
        per_mm = [d / self.length for d in delta]
        self.nominal = speed_mm_s
        asked = motion.retract_mm_s2 if not path else motion.print_mm_s2 if e else motion.travel_mm_s2
        self.acceleration = asked
        for part, speed, acceleration in zip(
            per_mm, motion.speed_mm_s, motion.acceleration_mm_s2, strict=True
        ):
            if part:
                self.nominal = min(self.nominal, speed / abs(part))
                self.acceleration = min(self.acceleration, acceleration / abs(part))
        norm = math.sqrt(sum(part * part for part in per_mm))
        self.direction = [part / norm for part in per_mm]
        self.entry_limit = 0.0

    def follow(self, before: "Segment", motion: Motion) -> None:
        """Set the highest speed with which it may begin behind another one, in mm/s."""
        cos = -sum(a * b for a, b in zip(before.direction, self.direction, strict=True))
        slowest = min(self.nominal, before.nominal)
        if cos > 0.999999:  # straight back
            self.entry_limit = 0.0
            return
        turn = [b - a for a, b in zip(before.direction, self.direction, strict=True)]
        size = math.sqrt(sum(part * part for part in turn))
        limit = self.acceleration
        if size > 0:
            for part, acceleration in zip(turn, motion.acceleration_mm_s2, strict=True):
                if limit * abs(part) / size > acceleration:
                    limit = acceleration * size / abs(part)
        half = math.sqrt(0.5 * (1.0 - max(cos, -0.999999)))
        square = limit * motion.junction_deviation_mm * half / (1.0 - half)
        if self.length < 1.0 and cos < -math.sqrt(0.5):  # pieces of an arc
            square = min(square, self.length * limit / math.acos(-max(cos, -0.999999)))
        self.entry_limit = min(math.sqrt(square), slowest)

    def duration(self, entry: float, leave: float) -> float:
        """Seconds from the speed ``entry`` to ``leave``, both in mm/s."""
        a, v = self.acceleration, self.nominal
        up, down = (v * v - entry * entry) / (2 * a), (v * v - leave * leave) / (2 * a)
        if up + down <= self.length:
            return (v - entry) / a + (v - leave) / a + (self.length - up - down) / v
        v = max(math.sqrt(a * self.length + (entry * entry + leave * leave) / 2), entry, leave)
        return (2 * v - entry - leave) / a
