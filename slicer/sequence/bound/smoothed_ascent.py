"""The ascent of the bound: steps of a quasi-Newton method up its smoothed form, which cools as they go on.

At a high temperature the smoothed bound is far below the bound and easy to climb, at a low one close to it
and full of edges. A few steps at each temperature lead within 2 % of the optimum after sixty of them, where
subgradients need six hundred (10x10_s1, seconds of travel).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.quasi_newton import QuasiNewton, dot
from slicer.sequence.bound.smoothed_bound import SmoothedBound

WARMEST = 0.2
"""The first temperature, in travels of usual length."""
COLDEST = 0.02
"""The last one, in travels to the nearest toolpath."""
STAGES = 10
"""Temperatures between them."""
STEPS_EACH = 6
"""Steps at a temperature."""
RARELY = 0.2
"""A multiplier that a smaller share of walks uses goes no farther for its gradient."""
LONGEST = 10.0
"""No step moves a multiplier farther than so many travels of usual length: curvature is told by few steps."""
ENOUGH = 1e-4
"""A step must gain this part of what its slope promises."""
HARDLY, PATIENCE = 2e-4, 5
"""Where it is coldest, so many steps that gain less than this part of what is left each are a standstill."""
TRIES = 5
"""A step that is shortened more often leads nowhere."""


def never() -> bool:
    """For what need not stop."""
    return False


class Point(NamedTuple):
    """What was seen at some multipliers, of those in use.

    Attributes:
        bound: the smoothed bound.
        held: int64 (a,), which multipliers are in use.
        gradient, use: float64 (a,), see ``Smoothed``.
    """

    bound: float
    held: NDArray[np.int64]
    gradient: NDArray[np.float64]
    use: NDArray[np.float64]


class SmoothedAscent:
    """Where an ascent is, carried between calls.

    Attributes:
        multipliers: float64, where it is.
    """

    def __init__(self, multipliers: NDArray[np.float64], nearest: float, mean: float) -> None:
        """Begin at some multipliers.

        Args:
            multipliers: where to begin.
            nearest: what travels to the nearest toolpath cost.
            mean: what travels cost on average. Where that is much more, as between islands, multipliers
                have a long way to go.
        """
        self.multipliers = multipliers
        self._temperature, self._coldest = WARMEST * max(nearest, mean), COLDEST * nearest
        self._cooling = (self._coldest / self._temperature) ** (1.0 / STAGES)
        self._longest = LONGEST * max(nearest, mean)
        self._steps = self._idle = 0
        self._curvature = QuasiNewton()
        self._seen: tuple[SmoothedBound, Point] | None = None

    def climb(
        self,
        smoothed: SmoothedBound,
        target: float,
        evaluations: int,
        should_stop: Callable[[], bool] = never,
    ) -> bool:
        """Look at the smoothed bound so many times, or a few more, unless it is to stop.

        Returns:
            Whether it has come to a standstill.
        """
        left = evaluations
        if self._seen is None or self._seen[0] is not smoothed:
            smoothed.cool(self._temperature)
            self._seen = smoothed, self._look(smoothed, self.multipliers)
            left -= 1
        while left > 0 and self._seen[1].bound < target and not should_stop():
            here = self._seen[1]
            if self._steps >= STEPS_EACH and self._temperature > self._coldest:
                self._seen = smoothed, self._cool(smoothed)
                left -= 1
                continue
            there, tried = self._step(smoothed, here, should_stop)
            left -= tried
            self._steps += 1
            if there is None:
                if self._temperature <= self._coldest:
                    return not should_stop()
                self._steps = STEPS_EACH
                continue
            self._seen = smoothed, there
            hardly = there.bound - here.bound < HARDLY * (target - here.bound)
            self._idle = self._idle + 1 if hardly else 0
            if self._idle >= PATIENCE and self._temperature <= self._coldest:
                return True
        return False

    def leave(self) -> None:
        """Let go of the smoothed bound; it is looked at anew in the next one."""
        self._seen = None

    def _look(self, smoothed: SmoothedBound, multipliers: NDArray[np.float64]) -> Point:
        found = smoothed.at(multipliers)
        self._curvature.hold((found.use > 0.0) | (found.gradient != 0.0))
        held = self._curvature.active
        return Point(found.bound, held, found.gradient[held], found.use[held])

    def _cool(self, smoothed: SmoothedBound) -> Point:
        """Go to the next temperature."""
        cooler = max(self._cooling * self._temperature, self._coldest)
        self._curvature.rescale(self._temperature / cooler)
        self._temperature, self._steps = cooler, 0
        smoothed.cool(cooler)
        return self._look(smoothed, self.multipliers)

    def _step(
        self, smoothed: SmoothedBound, here: Point, should_stop: Callable[[], bool]
    ) -> tuple[Point | None, int]:
        """One step up: where it leads, or None where it leads nowhere, and how often it looked."""
        scale = self._temperature / (here.use + RARELY)
        # A step that came to nothing may have brought more multipliers into use since it was looked here.
        gradient, scale = self._now(here.gradient, here.held), self._now(scale, here.held)
        way = self._curvature.direction(gradient, scale)
        slope = dot(way, gradient)
        if slope <= 0.0:
            self._curvature.forget()
            way = scale * gradient
            slope = dot(way, gradient)
        if slope <= 0.0:
            return None, 0
        held = self._curvature.active
        length = min(1.0, self._longest / float(np.abs(way).max()))
        for tried in range(1, TRIES + 1):
            further = self.multipliers.copy()
            further[held] += length * way
            there = self._look(smoothed, further)
            gain = there.bound - here.bound
            if gain >= ENOUGH * length * slope:
                step = self._now(length * way, held)
                self._curvature.learn(step, self._now(gradient, held) - there.gradient)
                self.multipliers = further
                return there, tried
            # To the top of the parabola through both values, with the slope here.
            top = 0.5 * slope * length / (slope * length - gain) if np.isfinite(gain) else 0.0
            length *= min(0.5, max(0.1, top))
            if should_stop():
                return None, tried
        self._curvature.forget()
        return None, TRIES

    def _now(self, values: NDArray[np.float64], held: NDArray[np.int64]) -> NDArray[np.float64]:
        """The values of some multipliers as those of all that are in use now, 0 where there were none."""
        out = np.zeros(len(self._curvature.active))
        out[np.searchsorted(self._curvature.active, held)] = values
        return out
