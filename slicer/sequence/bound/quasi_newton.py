"""Limited-memory BFGS (Nocedal, "Updating quasi-Newton matrices with limited storage", Mathematics of
Computation 35, 1980) for a function that is to be raised and whose many coordinates mostly stay at rest.

Of a sheet's multipliers one in twenty is used by walks that count. Only these are held, and more as they
come into use.
"""

import numpy as np
from numpy.typing import NDArray

PAIRS = 8
"""Steps that the curvature is learned from."""
TINY = 1e-200
"""A gradient changes by nothing if the square of that is no more."""


class QuasiNewton:
    """What is known of a function's curvature along the last steps.

    Attributes:
        active: int64 (a,), the coordinates that are held, ascending.
    """

    def __init__(self) -> None:
        self.active = np.empty(0, np.int64)
        self._steps: list[NDArray[np.float64]] = []
        self._falls: list[NDArray[np.float64]] = []

    def hold(self, used: NDArray[np.bool_]) -> None:
        """Hold these coordinates, of all there are, as well."""
        grown = used.copy()
        grown[self.active] = True
        if np.count_nonzero(grown) == len(self.active):
            return
        before, self.active = self.active, np.flatnonzero(grown)
        place = np.searchsorted(self.active, before)
        self._steps = [_spread(step, place, len(self.active)) for step in self._steps]
        self._falls = [_spread(fall, place, len(self.active)) for fall in self._falls]

    def forget(self) -> None:
        """Begin anew, where what was learned leads nowhere."""
        self._steps, self._falls = [], []

    def rescale(self, factor: float) -> None:
        """Take the curvature for so many times what it was."""
        self._falls = [factor * fall for fall in self._falls]

    def learn(self, step: NDArray[np.float64], fall: NDArray[np.float64]) -> None:
        """Note by how much the gradient fell along a step, both (a,); no curvature is not worth noting."""
        if dot(fall, fall) < TINY or dot(step, fall) <= 1e-12 * np.sqrt(dot(step, step) * dot(fall, fall)):
            return
        self._steps = [*self._steps, step][-PAIRS:]
        self._falls = [*self._falls, fall][-PAIRS:]

    def direction(self, gradient: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
        """The way to the top of a parabola of the known curvature.

        Args:
            gradient: float64 (a,).
            scale: float64 (a,), a guess of how far one coordinate goes for its gradient.
        """
        out = gradient.copy()
        weights = []
        for step, fall in zip(reversed(self._steps), reversed(self._falls), strict=True):
            weights.append(dot(step, out) / dot(fall, step))
            out -= weights[-1] * fall
        out *= scale
        if self._steps:
            fall = self._falls[-1]
            out *= dot(self._steps[-1], fall) / dot(fall, scale * fall)
        for step, fall, weight in zip(self._steps, self._falls, reversed(weights), strict=True):
            out += (weight - dot(fall, out) / dot(fall, step)) * step
        return out


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The inner product, summed alike on every machine: a BLAS shares it among as many cores as there are."""
    return float((a * b).sum())


def _spread(values: NDArray[np.float64], place: NDArray[np.int64], size: int) -> NDArray[np.float64]:
    out = np.zeros(size)
    out[place] = values
    return out
