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
from slicer.pieces import FREED, LEFT, RIGHT, USED
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
from slicer.skyline import (
    Skyline,
    append,
    clear,
    lay,
    lay_to_leave,
    new_skyline,
    replace,
    skyline_with_room,
    with_laid,
)

TRIES_PER_TOOLPATH = {"quick": 40, "default": 300, "high": 1_000}
BODY_TRIES_PER_TOOLPATH = {"quick": 5, "default": 40, "high": 300}
"""A body's skyline is raised by each toolpath over all that its cone and barrel reach, which takes longer."""
SWEEPS = 2
WINDOW = 60
"""Positions that are priced together."""
ROOM_FACTOR, ROOM_PER_POSITION = 8, 16
"""Room of the copy of a skyline with a body, in pieces: beyond it a window is left as it is."""
SLICE = 50 * WINDOW
"""Positions between two looks at the clock: whole windows."""


def refine(search: Search, oriented: NDArray[np.int32]) -> NDArray[np.int32]:
    """Improve a printable sequence (n,) by the true cost of its travels; what comes back costs no more."""
    problem, objective = search.problem, search.objective
    if problem.n < 3:
        return oriented
    work = tour_of(search, oriented)
    state = search.random_state(Draws.REFINEMENT)
    per_toolpath = TRIES_PER_TOOLPATH if problem.body.is_point else BODY_TRIES_PER_TOOLPATH
    tries = per_toolpath[search.effort] * WINDOW // (2 * SWEEPS)
    worse = float(np.median(work.cost[0, 2:-1]))
    for _ in range(SWEEPS):
        if search.should_stop():
            break
        sky = new_skyline(problem.segments, problem.body, 0)
        for low in range(1, problem.n + 1, SLICE):
            high = min(low + SLICE, problem.n + 1)
            sky = _sweep(work, state, tries, worse, sky, low, high)
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
    sky: Skyline,
    low: int,
    end: int,
) -> Skyline:
    """Windows that overlap by half from position low to end, ``tries`` exchanges in each.

    The skyline ends with what comes before the toolpath that is left for ``low``; it is brought up to the one
    before ``end`` and returned.
    """
    points, near, fixed, longest, order = tour.points, tour.near, tour.fixed, tour.longest, tour.order
    n = order.shape[1] - 2
    segments = points.reshape(n, 2, 2)
    copy = skyline_with_room(2 * n + 2, sky.body, sky.floor)
    spare = np.empty((max(longest, REACH), 3))
    while low < end:
        high = min(n + 1, low + WINDOW)
        first = max(low, fixed)
        needed = ROOM_FACTOR * (sky.place[USED] - sky.place[FREED]) + ROOM_PER_POSITION * WINDOW
        if sky.body.half_width > 0.0 and len(copy.piece) < needed:
            copy = skyline_with_room(needed, sky.body, sky.floor)
        now = _price(tour, sky, copy, low, high)
        for _ in range(tries if high - first > 1 and now < np.inf else 0):
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
            then = _price(tour, sky, copy, low, high)
            if then < now - LEAST_GAIN:
                now = then
            else:
                exchange(tour, i, i + k - j, k, turn_b, turn_a, spare)
        for p in range(max(1, low - 1), min(high, low + WINDOW // 2) - 1):
            sky = with_laid(sky, segments[order[0, p] >> 1], -1)
        low += WINDOW // 2
    return sky


@inner_kernel
def _may_turn(tour: Tour, low: int, high: int) -> int:
    """1 where all toolpaths at positions [low, high) may be printed the other way, else 0."""
    for p in range(low, high):
        if not tour.allowed[tour.order[0, p] ^ 1]:
            return 0
    return 1


@inner_kernel
def _price(
    tour: Tour,
    sky: Skyline,
    copy: Skyline,
    low: int,
    high: int,
) -> float:
    """True cost of the travels into positions low .. high, on a copy of the skyline before low - 1.

    Infinite where the copy has not enough room.
    """
    points, cost_model, order = tour.points, tour.cost_model, tour.order
    n = order.shape[1] - 2
    segments = points.reshape(n, 2, 2)
    clear(copy)
    at = sky.link[LEFT, RIGHT]
    while at != RIGHT:  # only pieces that are still seen
        append(copy, sky.piece, at)
        at = sky.link[at, RIGHT]
    total = 0.0
    for p in range(low, min(high, n) + 1):
        v = order[0, p]
        if p > 1:
            u = order[0, p - 1]
            start, end = segments[u >> 1, 1 - (u & 1)], segments[v >> 1, v & 1]
            left = segments[u >> 1]
            if copy.body.half_width == 0.0:
                replace(copy.piece, copy.link, copy.place, left)
            elif not lay_to_leave(copy, left, 1 - (u & 1)):
                return np.inf
            total += skyline_cost(copy.piece, copy.link, copy.place, copy.hull, start, end, cost_model)
            if copy.body.half_width > 0.0 and not lay(copy, left):
                return np.inf
        elif order[0, 0] < -1 and (v & 1) != -2 - order[0, 0]:
            total += FORBIDDEN
    return total
