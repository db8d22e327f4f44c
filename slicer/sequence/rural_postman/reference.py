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
from slicer.sequence.problem import Draws, Objective, Problem, compressed, neighbours, random_state
from slicer.sequence.rural_postman.relaxation import Relaxation
from slicer.sequence.rural_postman.reversals import Path, anneal_without_precedence

KICKS = {"quick": 100, "default": 1_000, "high": 10_000}
"""For each toolpath."""
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


def without_precedence(
    problem: Problem, oriented: NDArray[np.int32], *, effort: str = "default", seed: int = 0
) -> Unordered:
    """Shorten a sequence's straight travel, whatever precedence and allowed directions say.

    Args:
        problem: whose first toolpath, if it names one, stays first, in the direction that it has.
        oriented: int32 (n,), the printable sequence to begin with.
        effort, seed: as for ``sequence.solve``.
    """
    begin = time.perf_counter()
    free = _freed(problem)
    n = problem.n
    sequence = np.array(oriented, np.int32)
    position = np.empty(n, np.int32)
    position[sequence >> 1] = np.arange(n)
    path = Path(
        points=free.segments.reshape(-1, 2),
        # What may follow an oriented toolpath is near the endpoint at which it is left.
        near=neighbours(free).after.reshape(n, 2, -1)[:, ::-1].reshape(2 * n, -1).copy(),
        sequence=sequence,
        position=position,
        turned=np.empty((LOG, 2), np.int32),
        turns=np.zeros(1, np.int64),
        queue=np.empty(n + 1, np.int32),
        queued=np.zeros(n, np.bool_),
        fixed=0 if problem.first is None else 1,
        best=sequence.copy(),
    )
    if n > 1:
        state = random_state(seed, Draws.RURAL_POSTMAN)
        steps = free.segments[:, 1] - free.segments[:, 0]
        length = float(np.hypot(steps[:, 0], steps[:, 1]).mean())
        kicks = KICKS[effort] * n
        for done in range(0, kicks, AT_ONCE):  # Ctrl-C comes through between
            part = min(AT_ONCE, kicks - done)
            heat, cooled = (HEAT * length * (1.0 - at / kicks) for at in (done, done + part))
            anneal_without_precedence(path, state, part, heat, cooled)
    order, flipped = (sequence >> 1).astype(np.int64), (sequence & 1).astype(np.bool_)
    travel = free.travel_mm(order, flipped)
    bound = 0.0
    if n > 1:
        programmed = n <= PROGRAM_UP_TO[effort] and find_spec("highspy") is not None
        bound = _programmed(free, path, ROUNDS[effort]) if programmed else _bound(free, travel, STEPS[effort])
        bound = min(bound, travel)
    return Unordered(order, flipped, travel, bound, time.perf_counter() - begin)


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


def _bound(free: Problem, travel_mm: float, steps: int) -> float:
    tree = TreeBound(free, Objective().cost_model)
    for _ in range(steps):
        tree.improve(travel_mm)
    return tree.bound


def _programmed(free: Problem, path: Path, rounds: int) -> float:
    """The bound of a linear program that begins with travels between near ends, and those of the path."""
    entered, left = path.sequence.astype(np.int64), path.sequence.astype(np.int64) ^ 1
    n2 = 2 * free.n
    begins = np.zeros(n2, np.bool_)
    begins[free.starts] = True
    near = np.stack([np.repeat(np.arange(n2), path.near.shape[1]), path.near.reshape(-1)], axis=1)
    ends = np.arange(n2)
    travels = [
        near[near[:, 1] >= 0],
        np.stack([left[:-1], entered[1:]], axis=1),
        np.stack([ends[begins], np.full(begins.sum(), n2)], axis=1),
        np.stack([ends, np.full(n2, n2 + 1)], axis=1),
    ]
    relaxed = Relaxation(path.points, begins, np.concatenate(travels))
    relaxed.raise_bound(rounds)
    return relaxed.bound
