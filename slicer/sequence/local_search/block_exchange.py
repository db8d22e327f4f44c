"""Block exchange: the move of local search, its kernels on flat arrays, and its state.

Two neighbouring blocks of the sequence change places. Each keeps its inner order, which makes printability
cheap to check, and may be *complemented*: each of its toolpaths printed the other way. In a zigzag of
parallel lines the complement costs about the same, so that a block of odd length can leave one without
spoiling the directions of the rest. A toolpath that may be printed in one direction alone keeps its blocks
from that. The idea of the exchange is that of Gambardella and Dorigo, "An ant
colony system hybridized with a new local search for the sequential ordering problem", INFORMS J. Comput. 12,
2000.

Kernels that allocate read the fields of a ``Tour`` once, before their loops: numba counts references to an
array of a tuple at each access. For the same reason they index rows instead of naming them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.problem import CostModel, Neighbours, Objective, Problem, arc_cost, start_of

LEAST_GAIN = 1e-9
"""A gain must be more than rounding can feign."""

LONGEST, SHORTEST = 3_000, 200
"""How many toolpaths a block may hold: the first for sequences of up to 10,000, the second at least."""


class Tour(NamedTuple):
    """A sequence that the kernels rewrite in place, and what they need to know about the problem.

    Positions run from 1 to n. Position 0 holds the mark that stands before the first toolpath, position
    n + 1 the end, -1.

    Attributes:
        points: float64 (2n, 2), the entry of each oriented toolpath; it is left at ``points[u ^ 1]``.
        cost_model: what a travel costs.
        links: int32, the precedence: those before s are ``links[links[2 * s] : links[2 * s + 1]]``, those
            after it ``links[links[2 * s + 1] : links[2 * s + 2]]``.
        allowed: bool (2n,), whether a toolpath may be printed so.
        near: int32 (2n, 2, k), what can directly follow oriented toolpath u, and what it can follow.
        fixed: the first position that may change.
        longest: how many toolpaths a block may hold.
        order: int32 (2, n + 2); row 0: the oriented toolpath at each position; row 1: the position of each
            toolpath.
        cost: float64 (2, n + 2); row 0: cost of the travel that ends at each position; row 1: what that
            travel costs more if the toolpaths at both its ends are flipped; infinite where one may not be.
    """

    points: NDArray[np.float64]
    cost_model: CostModel
    links: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    near: NDArray[np.int32]
    fixed: int
    longest: int
    order: NDArray[np.int32]
    cost: NDArray[np.float64]

    @property
    def oriented(self) -> NDArray[np.int32]:
        """int32 (n,), a copy of the sequence without its marks."""
        return self.order[0, 1:-1].copy()

    @property
    def total(self) -> float:
        """The cost of all direct travels."""
        return float(self.cost[0].sum())


def new_tour(problem: Problem, objective: Objective, near: Neighbours, oriented: NDArray[np.int32]) -> Tour:
    """A tour that starts as the sequence ``oriented`` (n,); travels cost what the direct ones do."""
    n = problem.n
    order = np.zeros((2, n + 2), np.int32)
    order[0, 0], order[0, 1:-1], order[0, -1] = start_of(problem), oriented, -1
    made = Tour(
        problem.segments.reshape(-1, 2),
        objective.cost_model,
        _links(problem),
        problem.allowed.ravel(),
        np.stack([near.after, near.before], axis=1),
        1 if problem.first is None else 2,
        max(SHORTEST, min(LONGEST, LONGEST * 10_000 // n)),
        order,
        np.zeros((2, n + 2)),
    )
    refresh(made, 1, n + 1)
    return made


def _links(problem: Problem) -> NDArray[np.int32]:
    """The precedence both ways in one array; see ``Tour.links``."""
    n, m = problem.n, len(problem.edges)
    links = np.empty(2 * n + 1 + 2 * m, np.int32)
    links[: 2 * n + 1 : 2] = problem.pred_start + problem.succ_start
    links[1 : 2 * n : 2] = problem.pred_start[1:] + problem.succ_start[:-1]
    links[: 2 * n + 1] += 2 * n + 1
    below, above = np.diff(problem.pred_start), np.diff(problem.succ_start)
    is_pred = np.repeat(np.tile([True, False], n), np.stack([below, above], axis=1).ravel())
    body = links[2 * n + 1 :]
    body[is_pred], body[~is_pred] = problem.pred, problem.succ
    return links


@bare_kernel
def refresh(
    tour: Tour,
    low: int,
    high: int,
) -> None:
    """Bring positions and costs up to date after positions [low, high) were rewritten."""
    points, cost_model, order, cost = tour.points, tour.cost_model, tour.order, tour.cost
    allowed = tour.allowed
    n = order.shape[1] - 2
    for p in range(low, min(high + 1, n + 2)):
        u, v = order[0, p - 1], order[0, p]
        cost[0, p] = arc_cost(points, cost_model, u, v)
        cost[1, p] = 0.0
        if 1 < p <= n:
            cost[1, p] = np.inf
            if allowed[u ^ 1] and allowed[v ^ 1]:
                cost[1, p] = arc_cost(points, cost_model, u ^ 1, v ^ 1) - cost[0, p]
        if p < high:
            order[1, v >> 1] = p


@inner_kernel
def exchange(
    tour: Tour,
    i: int,
    j: int,
    k: int,
    turn_a: int,
    turn_b: int,
    spare: NDArray[np.float64],
) -> None:
    """Let blocks A = [i, j) and B = [j, k) change places, each complemented where its flag is 1.

    ``spare``, float64 (m, 3), is room for A.
    """
    order, cost = tour.order, tour.cost
    for p in range(j - i):
        spare[p, 0], spare[p, 1], spare[p, 2] = order[0, i + p], cost[0, i + p], cost[1, i + p]
    for p in range(k - j):
        order[0, i + p] = order[0, j + p] ^ turn_b
        cost[0, i + p] = cost[0, j + p]
        if turn_b:  # elsewhere the difference may be infinite
            cost[0, i + p] += cost[1, j + p]
        cost[1, i + p] = (1 - 2 * turn_b) * cost[1, j + p]
    start = i + k - j
    for p in range(j - i):
        order[0, start + p] = int(spare[p, 0]) ^ turn_a
        cost[0, start + p] = spare[p, 1]
        if turn_a:
            cost[0, start + p] += spare[p, 2]
        cost[1, start + p] = (1 - 2 * turn_a) * spare[p, 2]
    for p in range(i, k):
        order[1, order[0, p] >> 1] = p
    refresh(tour, i, i)
    refresh(tour, start, start)
    refresh(tour, k, k)
