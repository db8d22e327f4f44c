"""Descent by block exchange: from each touched toolpath to the next local optimum."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.local_search.block_exchange import LEAST_GAIN, Tour, exchange
from slicer.sequence.problem import arc_cost, costs_at_least

Move = tuple[float, int, int, int, int, int]
"""Gain, and the arguments i, j, k, turn_a, turn_b of ``exchange``."""


@inner_kernel
def move_back(
    tour: Tour,
    p: int,
    q: int,
    turn_b: int,
    best: Move,
) -> Move:
    """Bring a block that starts at q directly behind position p < q - 1; the end with the most gain.

    A = [p + 1, q), B = [q, k), complemented or not as ``turn_b`` says; A is, where that is cheaper and
    allowed. B is allowed to begin so; what else may not be flipped makes the flip cost infinitely more.
    """
    points, cost_model, links = tour.points, tour.cost_model, tour.links
    longest, order, cost = tour.longest, tour.order, tour.cost
    n = order.shape[1] - 2
    i, j = p + 1, q
    s = order[0, j] >> 1
    for t in range(links[2 * s], links[2 * s + 1]):
        if i <= order[1, links[t]] < j:
            return best  # before anything of the length of A is looked at
    turned = 0.0 if j - i > 1 or tour.allowed[order[0, i] ^ 1] else np.inf
    for t in range(i + 1, j):
        turned += cost[1, t]
    x, a0, a1 = order[0, p], order[0, i], order[0, j - 1]
    fresh = cost[0, i] + cost[0, j] - arc_cost(points, cost_model, x, order[0, j] ^ turn_b)
    for k in range(j + 1, min(j + longest, n + 1) + 1):
        b1 = order[0, k - 1]
        for t in range(links[2 * (b1 >> 1)], links[2 * (b1 >> 1) + 1]):
            if i <= order[1, links[t]] < j:
                return best
        if k - 1 > j and turn_b:
            fresh -= cost[1, k - 1]
        b1 ^= turn_b
        open_gain = fresh + cost[0, k]
        c = order[0, k]
        if not costs_at_least(points, cost_model, b1, a0, open_gain - best[0]):
            gain = open_gain - arc_cost(points, cost_model, b1, a0) - arc_cost(points, cost_model, a1, c)
            if gain > best[0]:
                best = (gain, i, j, k, 0, turn_b)
        if not costs_at_least(points, cost_model, b1, a0 ^ 1, open_gain - turned - best[0]):
            gain = (
                open_gain
                - turned
                - arc_cost(points, cost_model, b1, a0 ^ 1)
                - arc_cost(points, cost_model, a1 ^ 1, c)
            )
            if gain > best[0]:
                best = (gain, i, j, k, 1, turn_b)
    return best


@inner_kernel
def move_on(
    tour: Tour,
    p: int,
    q: int,
    turn_a: int,
    best: Move,
) -> Move:
    """Bring a block that ends at p directly before position q > p + 1; the start with the most gain.

    A = [i, p], B = [p + 1, q); the mirror image of ``move_back``.
    """
    points, cost_model, links, fixed = tour.points, tour.cost_model, tour.links, tour.fixed
    longest, order, cost = tour.longest, tour.order, tour.cost
    j, k = p + 1, q
    s = order[0, p] >> 1
    for t in range(links[2 * s + 1], links[2 * s + 2]):
        if j <= order[1, links[t]] < k:
            return best  # before anything of the length of B is looked at
    turned = 0.0 if k - j > 1 or tour.allowed[order[0, j] ^ 1] else np.inf
    for t in range(j + 1, k):
        turned += cost[1, t]
    c, b0, b1 = order[0, k], order[0, j], order[0, k - 1]
    fresh = cost[0, j] + cost[0, k] - arc_cost(points, cost_model, order[0, p] ^ turn_a, c)
    for i in range(p, max(p - longest, fixed - 1), -1):
        a0 = order[0, i]
        for t in range(links[2 * (a0 >> 1) + 1], links[2 * (a0 >> 1) + 2]):
            if j <= order[1, links[t]] < k:
                return best
        if i < p and turn_a:
            fresh -= cost[1, i + 1]
        a0 ^= turn_a
        open_gain = fresh + cost[0, i]
        x = order[0, i - 1]
        if not costs_at_least(points, cost_model, b1, a0, open_gain - best[0]):
            gain = open_gain - arc_cost(points, cost_model, x, b0) - arc_cost(points, cost_model, b1, a0)
            if gain > best[0]:
                best = (gain, i, j, k, turn_a, 0)
        if not costs_at_least(points, cost_model, b1 ^ 1, a0, open_gain - turned - best[0]):
            gain = (
                open_gain
                - turned
                - arc_cost(points, cost_model, x, b0 ^ 1)
                - arc_cost(points, cost_model, b1 ^ 1, a0)
            )
            if gain > best[0]:
                best = (gain, i, j, k, turn_a, 1)
    return best


@inner_kernel
def cut_between(
    tour: Tour,
    q: int,
    p: int,
    turn_a: int,
    turn_b: int,
    best: Move,
) -> Move:
    """Let what ends at p come directly before what starts at q <= p; the cut between them that gains most.

    A = [q, j), B = [j, p + 1).
    """
    points, cost_model, links, order, cost = tour.points, tour.cost_model, tour.links, tour.order, tour.cost
    i, k = q, p + 1
    x, a0, c = order[0, i - 1], order[0, i] ^ turn_a, order[0, k]
    b1 = order[0, p] ^ turn_b
    fresh = cost[0, i] + cost[0, k] - arc_cost(points, cost_model, b1, a0)
    barred = 0  # travels of A, whose toolpaths may not be flipped
    if turn_a:
        for t in range(i + 1, k):
            if cost[1, t] == np.inf:
                barred += 1
            else:
                fresh -= cost[1, t]
    need = k
    for j in range(p, q, -1):
        b0 = order[0, j]
        for t in range(links[2 * (b0 >> 1)], links[2 * (b0 >> 1) + 1]):
            if i <= order[1, links[t]] < need:
                need = order[1, links[t]]
        if need <= i:
            return best
        # The travel into j is cut; those behind it, up to p, are B's.
        if turn_a:
            if cost[1, j] == np.inf:
                barred -= 1
            else:
                fresh += cost[1, j]
        if turn_b and j < p:
            if cost[1, j + 1] == np.inf:
                return best  # B would hold one that may not be flipped
            fresh -= cost[1, j + 1]
        if need < j or barred > 0:
            continue
        if not costs_at_least(points, cost_model, x, b0 ^ turn_b, fresh + cost[0, j] - best[0]):
            gain = (
                fresh
                + cost[0, j]
                - arc_cost(points, cost_model, x, b0 ^ turn_b)
                - arc_cost(points, cost_model, order[0, j - 1] ^ turn_a, c)
            )
            if gain > best[0]:
                best = (gain, i, j, k, turn_a, turn_b)
    return best


@inner_kernel
def best_move(
    tour: Tour,
    u: int,
    v: int,
    best: Move,
) -> Move:
    """The best exchange that lets oriented toolpath ``v`` directly follow ``u``, if better than ``best``.

    Both must be allowed.
    """
    fixed, longest, order = tour.fixed, tour.longest, tour.order
    p, q = order[1, u >> 1], order[1, v >> 1]
    turn_u, turn_v = order[0, p] ^ u, order[0, q] ^ v
    if p < q:
        if q - p > longest or q == p + 1:
            return best
        if not turn_u:
            best = move_back(tour, p, q, turn_v, best)
        if not turn_v and p >= fixed:
            best = move_on(tour, p, q, turn_u, best)
        return best
    if p - q >= longest or q < fixed:
        return best
    return cut_between(tour, q, p, turn_v, turn_u, best)


@bare_kernel
def descend(
    tour: Tour,
    queue: NDArray[np.int32],
    queued: NDArray[np.bool_],
    count: int,
    span: NDArray[np.int64],
    spare: NDArray[np.float64],
) -> float:
    """Exchange blocks for gain until no touched toolpath has such a move; returns the gain in total.

    ``queue`` holds ``count`` touched toolpaths, which ``queued`` marks. ``span`` [low, high) is widened to
    the positions that were rewritten.
    """
    points, cost_model, near, order, cost = tour.points, tour.cost_model, tour.near, tour.order, tour.cost
    total = 0.0
    head = 0
    size = len(queue)
    while count > 0:
        s = queue[head]
        head = (head + 1) % size
        count -= 1
        queued[s] = False
        while True:
            p = order[1, s]
            u = order[0, p]
            best = (LEAST_GAIN, 0, 0, 0, 0, 0)
            for side in range(2):
                # A gain needs a travel from or to s that is cheaper than the one there is.
                limit = cost[0, p + 1 - side]
                for t in range(near.shape[2]):
                    v = near[u, side, t]
                    a, b = (u, v) if side == 0 else (v, u)
                    if v < 0 or arc_cost(points, cost_model, a, b) >= limit - LEAST_GAIN:
                        break
                    best = best_move(tour, a, b, best)
                    if best[3] > 0:
                        break
                if best[3] > 0:
                    break
            gain, i, j, k, turn_a, turn_b = best
            if k == 0:
                break
            total += gain
            exchange(tour, i, j, k, turn_a, turn_b, spare)
            span[0], span[1] = min(span[0], i), max(span[1], k)
            count = enqueue(
                order,
                queue,
                queued,
                head,
                count,
                i,
                i + k - j,
                k,
            )
    return total


@inner_kernel
def enqueue(
    order: NDArray[np.int32],
    queue: NDArray[np.int32],
    queued: NDArray[np.bool_],
    head: int,
    count: int,
    i: int,
    j: int,
    k: int,
) -> int:
    """Queue the toolpaths at both ends of the travels into positions i, j and k; the new length."""
    n = order.shape[1] - 2
    for p in (i - 1, i, j - 1, j, k - 1, k):
        if 1 <= p <= n:
            s = order[0, p] >> 1
            if not queued[s]:
                queued[s] = True
                queue[(head + count) % len(queue)] = s
                count += 1
    return count
