"""What the axes allow, in the plane of the sheet."""

import math
from dataclasses import dataclass
from typing import Self

from profiles import Profile


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
        x, y, z, e = profile.machine.max_speed_mm_s
        return cls(x, z, y, e) if profile.machine.plane == "XZ" else cls(y, z, x, e)

    def slowed(self, speed_mm_s: float, dx: float, dy: float, e: float = 0.0) -> float:
        """The speed along (dx, dy) that no axis exceeds, nor the feed while it advances by ``e`` mm."""
        length = math.hypot(dx, dy)
        if length == 0:
            return speed_mm_s
        for part, limit in ((dx, self.x_mm_s), (dy, self.y_mm_s), (e, self.e_mm_s)):
            if part:
                speed_mm_s = min(speed_mm_s, limit * length / abs(part))
        return speed_mm_s
