"""Heaters that approach their target as real ones do: fast at first, then slower."""

import math

AMBIENT_C = 20.0


class Heater:
    """One heater. ``time_constant_s`` is the time to come 63 % closer; temperatures in degrees Celsius."""

    def __init__(self, full_power_c: float, time_constant_s: float) -> None:
        self.full_power_c, self.time_constant_s = full_power_c, time_constant_s
        self.target = 0.0
        self._value, self._since = AMBIENT_C, 0.0

    def at(self, now: float) -> float:
        """The temperature at ``now`` seconds."""
        passed = now - self._since
        if passed <= 0:
            return self._value
        heating = self.target > self._value
        towards = self.full_power_c if heating else max(AMBIENT_C, self.target)
        value = towards + (self._value - towards) * math.exp(-passed / self.time_constant_s)
        return min(value, self.target) if heating else max(value, towards)

    def aim(self, target: float, now: float) -> None:
        """Set the target from ``now`` on; 0 is off."""
        self._value, self._since, self.target = self.at(now), now, target

    def report(self, now: float) -> str:
        """As in Marlin's reports: actual /target."""
        return f"{self.at(now):.2f} /{self.target:.2f}"
