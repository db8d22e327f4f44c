"""Refine a sequence by its true cost, which depends on the skyline at each moment.

What is printed before and after a stretch of the sequence does not change when the stretch is reordered, so
that the true cost of a change is that of the stretch alone: its travels over the skyline which stands when it
begins. Windows move along the sequence together with that skyline. In each of them exchanges of blocks are
drawn, some at random and some that look good by their straight travels, and kept if the window really gets
cheaper.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.local_search.block_exchange import LEAST_GAIN, Tour, exchange
from slicer.sequence.local_search.descent import best_move
from slicer.sequence.local_search.perturbation import REACH, random_exchange
from slicer.sequence.local_search.start import tour_of
from slicer.sequence.problem import (
    FORBIDDEN,
    Draws,
    Search,
    draw,
    skyline_cost,
    true_cost,
)
from slicer.skyline import LEFT, RIGHT, lay, new_skyline

TRIES_PER_TOOLPATH = {"quick": 5, "default": 40, "high": 300}
SWEEPS = 2
WINDOW = 60
"""Positions that are priced together."""
Skyline = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Pieces and links, see ``slicer.skyline``."""
SLICE = 50 * WINDOW
"""Positions between two looks at the clock: whole windows."""


def refine(search: Search, oriented: NDArray[np.int32]) -> NDArray[np.int32]:
    """Improve a printable sequence (n,) by the true cost of its travels; what comes back costs no more."""
    problem, objective = search.problem, search.objective
    if problem.n < 3:
        return oriented
    work = tour_of(search, oriented)
    state = search.random_state(Draws.REFINEMENT)
    tries = TRIES_PER_TOOLPATH[search.effort] * WINDOW // (2 * SWEEPS)
    worse = float(np.median(work.cost[0, 2:-1]))
    for _ in range(SWEEPS):
        if search.should_stop():
            break
        skyline, place = new_skyline(problem.n), (LEFT, 2)
        for low in range(1, problem.n + 1, SLICE):
            high = min(low + SLICE, problem.n + 1)
            place = _sweep(work, state, tries, worse, skyline, place, low, high)
            if search.should_stop():
                break
    refined = work.oriented
    if true_cost(problem, objective, refined) < true_cost(problem, objective, oriented):
        return refined
    return oriented


@kernel
def _sweep(
    tour: Tour,
    state: NDArray[np.uint64],
    tries: int,
    worse: float,
    skyline: Skyline,
    place: tuple[int, int],
    low: int,
    end: int,
) -> tuple[int, int]:
    """Windows that overlap by half from position low to end, ``tries`` exchanges in each.

    The skyline before ``low`` is brought up to that before ``end``; returns its cursor and its size.
    """
    points, near, fixed, longest, order = tour.points, tour.near, tour.fixed, tour.longest, tour.order
    n = order.shape[1] - 2
    segments = points.reshape(n, 2, 2)
    piece, link = skyline
    cursor, used = place
    scratch = new_skyline(n)
    hull = np.empty((4 * n + 8, 2))
    spare = np.empty((max(longest, REACH), 3))
    while low < end:
        high = min(n + 1, low + WINDOW)
        first = max(low, fixed)
        now = _price(tour, skyline, scratch, hull, low, high)
        for _ in range(tries if high - first > 1 else 0):
            turn_a, turn_b = 0, 0
            if draw(state) < 0.3:
                i, j, k = random_exchange(tour, state, first, high)
                turn_a, turn_b = int(draw(state) * 2), int(draw(state) * 2)
                turn_a *= _may_turn(tour, i, j)
                turn_b *= _may_turn(tour, j, k)
            else:
                u = order[0, first + int(draw(state) * (high - first))]
                side = int(draw(state) * 2)
                v = near[u, side, int(draw(state) * near.shape[2])]
                if v < 0:
                    continue
                if side == 1:
                    u, v = v, u
                _, i, j, k, turn_a, turn_b = best_move(
                    tour,
                    u,
                    v,
                    (-worse, 0, 0, 0, 0, 0),
                )
            if k == 0 or i < first or k > high:
                continue
            if order[0, 0] < -1 and i == 1:
                continue  # the direction of whatever comes first is fixed
            exchange(tour, i, j, k, turn_a, turn_b, spare)
            then = _price(tour, skyline, scratch, hull, low, high)
            if then < now - LEAST_GAIN:
                now = then
            else:
                exchange(tour, i, i + k - j, k, turn_b, turn_a, spare)
        for p in range(low, min(high, low + WINDOW // 2)):
            cursor, used = lay(piece, link, cursor, used, segments[order[0, p] >> 1])
        low += WINDOW // 2
    return cursor, used


@inner_kernel
def _may_turn(tour: Tour, low: int, high: int) -> int:
    """1 where all toolpaths at positions [low, high) may be printed the other way, else 0."""
    for p in range(low, high):
        if not tour.allowed[tour.order[0, p] ^ 1]:
            return 0
    return 1


@kernel
def _price(
    tour: Tour,
    skyline: Skyline,
    copy: Skyline,
    hull: NDArray[np.float64],
    low: int,
    high: int,
) -> float:
    """True cost of the travels into positions low .. high, on a copy of the skyline before low."""
    points, cost_model, order = tour.points, tour.cost_model, tour.order
    n = order.shape[1] - 2
    segments = points.reshape(n, 2, 2)
    (piece, link), (scratch, scratch_link) = skyline, copy
    used = 2
    at, last = link[LEFT, RIGHT], LEFT
    while at != RIGHT:  # only pieces that are still seen
        for axis in range(4):
            scratch[used, axis] = piece[at, axis]
        scratch_link[last, RIGHT], scratch_link[used, LEFT] = used, last
        last = used
        used += 1
        at = link[at, RIGHT]
    scratch_link[last, RIGHT], scratch_link[RIGHT, LEFT] = RIGHT, last
    cursor = LEFT
    total = 0.0
    for p in range(low, min(high, n) + 1):
        v = order[0, p]
        if p > 1:
            u = order[0, p - 1]
            start, end = segments[u >> 1, 1 - (u & 1)], segments[v >> 1, v & 1]
            travel, cursor = skyline_cost(scratch, scratch_link, cursor, start, end, hull, cost_model)
            total += travel
        elif order[0, 0] < -1 and (v & 1) != -2 - order[0, 0]:
            total += FORBIDDEN
        cursor, used = lay(scratch, scratch_link, cursor, used, segments[v >> 1])
    return total
