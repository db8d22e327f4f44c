"""Iterated local search: printable perturbations, each repaired by descent or taken back."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.local_search.block_exchange import Tour, exchange
from slicer.sequence.local_search.descent import descend, enqueue
from slicer.sequence.problem import draw

REACH = 30
"""How many positions apart the blocks of a perturbation may start, and how long the second may be."""

WINDOW = 2_000
"""How many positions the perturbations are drawn from at a time."""

CLOSE = 10
"""How far from their centre the exchanges of a perturbation start."""


@inner_kernel
def random_exchange(
    tour: Tour,
    state: NDArray[np.uint64],
    low: int,
    high: int,
) -> tuple[int, int, int]:
    """Draw two neighbouring blocks that may change places; (0, 0, 0) where the draw fails.

    The second block starts at j in [low, high), the first behind every toolpath that the one at j
    waits for. The second grows to a drawn length while what it takes in waits for nothing in the first.
    """
    links, fixed, order = tour.links, tour.fixed, tour.order
    n = order.shape[1] - 2
    j = low + int(draw(state) * (high - low))
    s = order[0, j] >> 1
    first = max(fixed, j - REACH)
    for t in range(links[2 * s], links[2 * s + 1]):
        first = max(first, order[1, links[t]] + 1)
    if first >= j:
        return 0, 0, 0
    i = first + int(draw(state) * (j - first))
    length = 1 + int(draw(state) * REACH)
    k = j + 1
    while k <= n and k - j < length:
        s = order[0, k] >> 1
        for t in range(links[2 * s], links[2 * s + 1]):
            if i <= order[1, links[t]] < j:
                return i, j, k
        k += 1
    return i, j, k


@kernel
def iterated_local_search(
    tour: Tour,
    state: NDArray[np.uint64],
    perturbations: int,
    low: int,
    high: int,
    temperature: float,
) -> float:
    """Perturb and descend so many times on the way from position low to high; returns the gain in total.

    Each time two exchanges close to each other are drawn: descent would just take back a single one. What
    is worse by d afterwards is kept with probability exp(-d / temperature). The perturbations
    move along the sequence within a window, so that what they touch stays in the processor's caches.
    """
    fixed, longest, order, cost = tour.fixed, tour.longest, tour.order, tour.cost
    n = order.shape[1] - 2
    if n + 1 - fixed < 2 or high <= low:
        return 0.0
    back, back_cost = order[0].copy(), cost.copy()
    queue = np.empty(n, np.int32)
    queued = np.zeros(n, np.bool_)
    span = np.empty(2, np.int64)
    spare = np.empty((max(longest, REACH), 3))
    total = 0.0
    window = min(WINDOW, high - low)
    for step in range(perturbations):
        centre = low + int((high - low - window) * step / perturbations + draw(state) * window)
        gain = 0.0
        count = 0
        span[0], span[1] = n + 2, 0
        for _ in range(2):
            i, j, k = random_exchange(tour, state, max(fixed, centre - CLOSE), min(n + 1, centre + CLOSE))
            if k == 0:
                continue
            gain += cost[0, i] + cost[0, j] + cost[0, k]
            exchange(tour, i, j, k, 0, 0, spare)
            middle = i + k - j
            gain -= cost[0, i] + cost[0, middle] + cost[0, k]
            span[0], span[1] = min(span[0], i), max(span[1], k)
            count = enqueue(order, queue, queued, 0, count, i, middle, k)
        if count == 0:
            continue
        gain += descend(tour, queue, queued, count, span, spare)
        if gain >= 0.0 or gain > temperature * np.log(1.0 - draw(state)):
            total += gain
            for p in range(span[0], span[1]):
                back[p] = order[0, p]
            for p in range(span[0], span[1] + 1):
                back_cost[0, p], back_cost[1, p] = cost[0, p], cost[1, p]
        else:
            for p in range(span[0], span[1]):
                order[0, p] = back[p]
                order[1, back[p] >> 1] = p
            for p in range(span[0], span[1] + 1):
                cost[0, p], cost[1, p] = back_cost[0, p], back_cost[1, p]
    return total
