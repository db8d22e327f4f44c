"""How short the travels through the same toolpaths could be if they could be printed in any order.

Without precedence the problem is the rural postman problem on the plane (Orloff, Networks 4, 1974): what a
printable sequence travels beyond it is the price of printability.

The bound is that of a linear program where HiGHS is installed (the extra ``postman``), else a spanning
tree's.
"""

import time
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from slicer.nozzle import POINT
from slicer.sequence.bound import TreeBound
from slicer.sequence.problem import Draws, Objective, Problem, Search, compressed, neighbours, random_state
from slicer.sequence.rural_postman.relaxation import Relaxation
from slicer.sequence.rural_postman.reversals import Path, anneal_without_precedence
from slicer.sequence.rural_postman.rounding import rounded

KICKS = {"quick": 100, "default": 1_000, "high": 10_000}
"""For each toolpath."""
TOURS = {"quick": 2, "default": 12, "high": 60}
"""Paths that are made from the solution of the linear program, and shortened."""
TOOLPATHS_OF_TOURS = {"quick": 3_000, "default": 12_000, "high": 200_000}
"""So many toolpaths in all of them, at about 1.4 ms each."""
NOISE, NEAR, TOUR_KICKS, TOUR_HEAT = (1.0, 0.2, 0.5), 6, 300, 0.1
"""How differently they are made, by turns, and how they are shortened: ends near by reduced cost, and milder
kicks.
"""
AT_ONCE = 50_000
HEAT = 0.8
"""What a kick may cost at the beginning, of the mean length of a toolpath; nothing in the end. Without it the
path soon stays as it is, whatever the number of kicks: lines side by side are passed to and fro, and to come
out at another end many travels have to change together.
"""
STEPS = {"quick": 100, "default": 500, "high": 2_000}
"""Of the ascent of a tree's bound."""
ROUNDS = {"quick": 40, "default": 150, "high": 1_000}
"""Of the linear program."""
PROGRAM_UP_TO = {"quick": 800, "default": 4_000, "high": 8_000}
"""Toolpaths up to which its solutions take less than a minute or so."""
RELATIVE_EPS = 1e-9
LOG = 100_000
"""Ranges turned round between two kicks; there are a few dozen."""


@dataclass(frozen=True, eq=False)
class Unordered:
    """A path through all toolpaths that pays no heed to precedence; no print can use it.

    Attributes:
        order: int64 (n,), the toolpath that comes k-th.
        flipped: bool (n,), whether it is passed from its second endpoint.
        travel_mm: its straight travel J.
        lower_bound_mm: no such path, and so no printable sequence, has less.
        runtime_s: seconds that both took.
    """

    order: NDArray[np.int64]
    flipped: NDArray[np.bool_]
    travel_mm: float
    lower_bound_mm: float
    runtime_s: float


def without_precedence(search: Search) -> Unordered:
    """Shorten the straight travel of a search's best sequence, whatever precedence and directions say.

    The first toolpath, if the problem names one, stays first, in the direction that it has. Where the search
    should stop, what has been found so far is given. To the search itself nothing is offered.
    """
    begin = time.perf_counter()
    free, effort, seed = _freed(search.problem), search.effort, search.seed
    n = free.n
    best, travel = search.oriented.copy(), _travel(free, search.oriented)
    bound = 0.0
    if n > 1:
        # What may follow an oriented toolpath is near the endpoint at which it is left.
        near = neighbours(free).after.reshape(n, 2, -1)[:, ::-1].reshape(2 * n, -1).copy()
        programmed = n <= PROGRAM_UP_TO[effort] and find_spec("highspy") is not None
        best, travel = _shortened(
            search, free, best, near, (KICKS[effort], HEAT), random_state(seed, Draws.RURAL_POSTMAN)
        )
        if programmed:
            relaxed = _programmed(free, best, near)
            relaxed.raise_bound(ROUNDS[effort], search.should_stop)
            bound = relaxed.bound
            tours = min(TOURS[effort], TOOLPATHS_OF_TOURS[effort] // n)
            best, travel = _from_parts(search, free, relaxed, (best, travel), tours)
        else:
            bound = _bound(search, free, travel, STEPS[effort])
        bound = min(bound, travel)
    order, flipped = (best >> 1).astype(np.int64), (best & 1).astype(np.bool_)
    return Unordered(order, flipped, travel, bound, time.perf_counter() - begin)


def _travel(free: Problem, oriented: NDArray[np.int32]) -> float:
    return free.travel_mm(oriented >> 1, oriented & 1)


def _shortened(
    search: Search,
    free: Problem,
    oriented: NDArray[np.int32],
    near: NDArray[np.int32],
    kicked: tuple[int, float],
    state: NDArray[np.uint64],
) -> tuple[NDArray[np.int32], float]:
    """A path shortened by local search with so many kicks for each toolpath, of such heat, and its travel."""
    n, (kicks, heat) = free.n, kicked
    sequence, position = oriented.copy(), np.empty(n, np.int32)
    position[sequence >> 1] = np.arange(n)
    path = Path(
        points=free.segments.reshape(-1, 2),
        near=near,
        sequence=sequence,
        position=position,
        turned=np.empty((LOG, 2), np.int32),
        turns=np.zeros(1, np.int64),
        queue=np.empty(n + 1, np.int32),
        queued=np.zeros(n, np.bool_),
        fixed=0 if free.first is None else 1,
        best=sequence.copy(),
    )
    steps = free.segments[:, 1] - free.segments[:, 0]
    length = float(np.hypot(steps[:, 0], steps[:, 1]).mean())
    for done in range(0, kicks * n, AT_ONCE):  # Ctrl-C comes through between
        if search.should_stop():
            break
        part = min(AT_ONCE, kicks * n - done)
        now, cooled = (heat * length * (1.0 - at / (kicks * n)) for at in (done, done + part))
        anneal_without_precedence(path, state, part, now, cooled)
    return sequence, _travel(free, sequence)


def _from_parts(
    search: Search, free: Problem, relaxed: Relaxation, known: tuple[NDArray[np.int32], float], tours: int
) -> tuple[NDArray[np.int32], float]:
    """The shortest of what a path, and those that the solution of the linear program leads to, come to."""
    (best, travel), near, seed = known, relaxed.near(NEAR), search.seed
    for k in range(tours):
        if travel <= relaxed.bound * (1 + RELATIVE_EPS) or search.should_stop():
            break
        noise = 0.0 if k == 1 else NOISE[k % len(NOISE)]
        start = best if k == 0 else rounded(relaxed, noise, np.random.default_rng((seed, k)))
        if start is not None:
            state = random_state(seed, Draws.RURAL_POSTMAN, k)
            found, length = _shortened(search, free, start, near, (TOUR_KICKS, TOUR_HEAT), state)
            if length < travel:
                best, travel = found, length
    return best, travel


def _freed(problem: Problem) -> Problem:
    """The same toolpaths without precedence, in any direction, for a nozzle that is a point."""
    none = np.empty((0, 2), np.int32)
    start, links = compressed(none[:, 0], none[:, 1], problem.n)
    return replace(
        problem,
        edges=none,
        below=none,
        pred_start=start,
        pred=links,
        succ_start=start,
        succ=links,
        body=POINT,
        allowed=np.ones((problem.n, 2), np.bool_),
    )


def _bound(search: Search, free: Problem, travel_mm: float, steps: int) -> float:
    tree = TreeBound(free, Objective().cost_model)
    for _ in range(steps):
        if search.should_stop():
            break
        tree.improve(travel_mm)
    return max(0.0, tree.bound)


def _programmed(free: Problem, oriented: NDArray[np.int32], near_ends: NDArray[np.int32]) -> Relaxation:
    """The linear program, which begins with travels between near ends, and those of a path."""
    entered, left = oriented.astype(np.int64), oriented.astype(np.int64) ^ 1
    n2 = 2 * free.n
    begins = np.zeros(n2, np.bool_)
    begins[free.starts] = True
    near = np.stack([np.repeat(np.arange(n2), near_ends.shape[1]), near_ends.reshape(-1)], axis=1)
    ends = np.arange(n2)
    travels = [
        near[near[:, 1] >= 0],
        np.stack([left[:-1], entered[1:]], axis=1),
        np.stack([ends[begins], np.full(begins.sum(), n2)], axis=1),
        np.stack([ends, np.full(n2, n2 + 1)], axis=1),
    ]
    return Relaxation(free.segments.reshape(-1, 2), begins, np.concatenate(travels))
