"""The bound with all walks weighed in place of the cheapest: smooth in its multipliers, never above it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.paid import Paid
from slicer.sequence.bound.pair_costs import BlockCosts, apply_multipliers
from slicer.sequence.bound.pair_dp import evaluate
from slicer.sequence.bound.smoothed_dp import Weights, smoothed_roots, weigh
from slicer.sequence.bound.smoothed_gradient import add_gradient
from slicer.sequence.bound.smoothed_shares import Shares, share_out
from slicer.sequence.bound.visits import by_start, charge_visits, settle_visits, share_visits_at_ends
from slicer.sequence.states import Blocks

MOST = 700.0
"""A cost of more temperatures is taken for this much: a weight below exp(-500) is told by logarithms."""
LEAST = -100.0
"""Where a travel costs less, logarithms tell all weights. Prices come to -64 on the sheets of the benchmarks,
and farther between islands."""
MOST_DETOUR = 87.0
"""Likewise, of the eighth root of a detour's weight in single precision."""


class Smoothed(NamedTuple):
    """The smoothed bound at some multipliers.

    Attributes:
        bound: its value.
        gradient: float64, how it grows with each multiplier.
        use: float64, the share of all walks that each multiplier is paid by, added up over blocks.
    """

    bound: float
    gradient: NDArray[np.float64]
    use: NDArray[np.float64]


class SmoothedBound:
    """The smoothed bound of blocks at one temperature after the other."""

    def __init__(
        self, blocks: Blocks, block_costs: BlockCosts, ends: Ends, paid: Paid, value: NDArray[np.float64]
    ) -> None:
        """Over blocks; ``paid`` and ``value`` are room for what the bound itself writes there as well."""
        self._blocks, self._costs, self._ends, self._paid = blocks, block_costs, ends, paid
        values = len(value)
        self._weights = Weights(
            np.inf,
            False,
            np.empty_like(block_costs.direct),
            np.empty_like(block_costs.ways),
            np.empty_like(paid.least),
            np.empty_like(paid.most),
            np.empty_like(paid.passing),
            np.empty_like(block_costs.detour),
            np.empty_like(block_costs.cross),
            np.empty(values),
            np.empty(values, np.int32),
        )
        self._shares = Shares(
            value,
            np.empty_like(block_costs.direct),
            np.empty_like(block_costs.ways),
            np.empty_like(block_costs.ways),
            np.empty_like(paid.passing),
        )
        self._gradient, self._use = np.empty((2, block_costs.size))
        self._no_travel, self._no_way = np.isinf(block_costs.direct), np.isinf(block_costs.ways)

    @property
    def temperature(self) -> float:
        """In the unit of the costs; infinite at first."""
        return self._weights.temperature

    def cool(self, temperature: float) -> None:
        """Go to another temperature."""
        self._weights = self._weights._replace(temperature=temperature)
        detour = self._weights.detour
        np.multiply(self._costs.detour, np.float32(-0.125 / temperature), out=detour)
        np.exp(np.maximum(detour, np.float32(-MOST_DETOUR), out=detour), out=detour)
        np.exp(self._costs.cross * (-1.0 / temperature), out=self._weights.cross)

    def evaluate(self, multipliers: NDArray[np.float64]) -> float:
        """The bound itself, over the same blocks; ``paid`` must be of these multipliers."""
        evaluate(self._blocks, self._costs, self._ends, self._paid, self._shares.value)
        bounds = by_start(self._blocks, self._costs, self._ends, multipliers, self._shares.value)
        return float(bounds.min())

    def at(self, multipliers: NDArray[np.float64]) -> Smoothed:
        """Its value and its gradient, until the next call; minus infinity where prices are too far off."""
        blocks, costs, ends, paid = self._blocks, self._costs, self._ends, self._paid
        temperature = self.temperature
        apply_multipliers(blocks, costs, multipliers, paid)
        charge_visits(blocks, costs, multipliers, paid)
        least = min(paid.arc.min(), paid.ways.min() + min(0.0, paid.passing.min()))
        weights = self._weights._replace(in_logarithms=bool(least < LEAST * temperature))
        for cost, weight in (
            (paid.arc, weights.arc),
            (paid.ways, weights.ways),
            (paid.least, weights.least),
            (paid.most, weights.most),
            (paid.passing, weights.passing),
        ):
            np.multiply(cost, -1.0 / temperature, out=weight)
            np.exp(np.clip(weight, -MOST, -LEAST, out=weight), out=weight)
        weights.arc[self._no_travel] = 0.0
        weights.ways[self._no_way] = 0.0
        weights.most[np.isinf(paid.most)] = 0.0
        weigh(blocks, costs, ends, paid, weights)
        roots = smoothed_roots(blocks, ends, weights)
        settle_visits(blocks, costs, ends, multipliers, roots)
        least = roots.min()
        gradient, use = self._gradient, self._use
        gradient[:] = use[:] = 0.0
        if not np.isfinite(least):
            return Smoothed(-np.inf, gradient, use)
        start_share = np.exp((least - roots) / temperature)
        total = start_share.sum()
        start_share /= total
        share_out(blocks, costs, ends, paid, weights, start_share, self._shares)
        add_gradient(blocks, costs, self._shares, paid.source, gradient, use)
        share_visits_at_ends(blocks, costs, ends, start_share, gradient)
        if not np.isfinite(gradient).all():
            return Smoothed(-np.inf, gradient, use)
        return Smoothed(float(least - temperature * np.log(total)), gradient, use)


def nearest(blocks: Blocks, costs: BlockCosts) -> float:
    """What the cheapest travel inside a block costs from each oriented toolpath, on average."""
    least = [np.zeros(0)]
    for k in range(blocks.blocks):
        size = 2 * int(blocks.path_start[k + 1] - blocks.path_start[k])
        travels = costs.direct[costs.arc_start[k] : costs.arc_start[k + 1]].reshape(size, size).copy()
        here = np.arange(size)
        travels[here, here] = travels[here, here ^ 1] = np.inf
        least.append(travels.min(axis=1))
    known = np.concatenate(least)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else 0.0
