"""A start for local search that has the large structure right: greedy along levels of a stream function.

Good sequences sweep over the sheet: along a toolpath, on along the one that continues it in the next tile,
and back on the next pair. Greedy does not see that; it climbs tile by tile and later pays for what it left
behind. So each toolpath is given a level that is about the same for toolpaths which continue each other and
grows by their distance from one to the next above, as near as both can be had: a weighted least squares
problem on a sparse graph. Greedy then prefers low levels.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.problem import (
    CostModel,
    Neighbours,
    Objective,
    Problem,
    direct_cost,
    direct_sum,
    directed,
)

WEIGHTS = (1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0)
"""Millimetres of travel that a millimetre of level is worth; each is tried."""

CONTINUATIONS = 3
"""How many neighbours at each end count as continuing a toolpath."""

EPS_MM = 1e-9

ROUNDS = 100
"""Steps of conjugate gradients, and as many again times the root of n / 5000."""

SLICE = 100
"""Rounds between two looks at the clock."""

SETTLED = 1e-12


def level_start(
    problem: Problem,
    objective: Objective,
    near: Neighbours,
    out_of_time: Callable[[], bool] = lambda: False,
) -> NDArray[np.int32]:
    """The best greedy sequence along levels, int32 (n,) oriented toolpaths, by the cost of direct travels.

    Where ``out_of_time`` says so, the levels are less exact and fewer weights are tried, one at least.
    """
    n = problem.n
    if n == 0:
        return np.empty(0, np.int32)
    level = levels(problem, near, out_of_time)
    points = problem.segments.reshape(-1, 2)
    cost_model = objective.cost_model
    lowest = problem.starts[np.argmin(level[problem.starts >> 1])]
    unit = direct_cost(cost_model, 1.0, 1.0) / np.sqrt(2.0)
    best, least = np.empty(0, np.int32), np.inf
    for weight in WEIGHTS:
        order = _climb(
            points,
            cost_model,
            problem.allowed,
            problem.pred_start,
            problem.succ_start,
            problem.succ,
            lowest,
            unit * weight * level,
        )
        oriented = directed(problem, order >> 1, objective)
        cost = direct_sum(problem.segments, cost_model, oriented)
        if cost < least:
            best, least = oriented, cost
        if out_of_time():
            break
    return best


def levels(
    problem: Problem, near: Neighbours, out_of_time: Callable[[], bool] = lambda: False
) -> NDArray[np.float64]:
    """float64 (n,), the level of each toolpath in mm, by conjugate gradients with diagonal scaling."""
    # What a nozzle's body forbids besides lies beside, not above.
    low, high = problem.below.T.astype(np.int64)
    gap = _gaps(problem.segments, low, high)
    # Toolpaths that touch end to end, as uprights do, are no measure of the distance between lines.
    apart = gap[gap > EPS_MM]
    pitch = float(np.median(apart)) if len(apart) else 1.0
    u = np.repeat(np.arange(2 * problem.n), min(CONTINUATIONS, near.after.shape[1]))
    v = near.after[:, :CONTINUATIONS].ravel().astype(np.int64)
    u, v = u[v >= 0], v[v >= 0]
    # What is right above continues nothing: it has an edge of its own.
    beside = ~np.isin((u >> 1) * problem.n + (v >> 1), low * problem.n + high)
    u, v = u[beside], v[beside]
    points = problem.segments.reshape(-1, 2)
    distance = np.hypot(*(points[v] - points[u ^ 1]).T)
    a = np.concatenate([low, u >> 1])
    b = np.concatenate([high, v >> 1])
    rise = np.concatenate([gap, np.zeros(len(u))])
    weight = np.concatenate([np.ones(len(low)), (pitch / (pitch + distance)) ** 2])
    rounds = int(ROUNDS * (1 + np.sqrt(problem.n / 5000)))
    level: NDArray[np.float64] = problem.segments[:, :, 1].mean(axis=1)
    memory, norm = np.zeros((3, problem.n)), -1.0
    for done in range(0, rounds, SLICE):
        norm = _solve(a, b, rise, weight, level, memory, norm, min(SLICE, rounds - done))
        if norm < SETTLED or out_of_time():
            break
    return level


def _gaps(
    segments: NDArray[np.float64], low: NDArray[np.int64], high: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Distances between the toolpaths ``low`` and ``high``, which do not cross, in mm."""
    gap = np.full(len(low), np.inf)
    for s, t in ((low, high), (high, low)):
        start, along = segments[t, 0], segments[t, 1] - segments[t, 0]
        squared = np.maximum((along**2).sum(axis=1), 1e-18)
        for f in range(2):
            away = segments[s, f] - start
            share = np.clip((away * along).sum(axis=1) / squared, 0.0, 1.0)
            gap = np.minimum(gap, np.hypot(*(away - share[:, None] * along).T))
    return gap


@kernel
def _solve(
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    rise: NDArray[np.float64],
    weight: NDArray[np.float64],
    x: NDArray[np.float64],
    memory: NDArray[np.float64],
    norm: float,
    rounds: int,
) -> float:
    """Minimise the sum of weight · (x[b] − x[a] − rise)² from ``x``; a faint pull keeps x unique.

    A slice of so many rounds. ``memory``, float64 (3, n), and the norm that is returned are handed to the
    next one; a negative norm begins. Below ``SETTLED`` nothing more is done.
    """
    # Loops, because array expressions take seconds to compile.
    n = len(x)
    diagonal, residual, step = memory[0], memory[1], memory[2]
    image = np.empty(n)
    if norm < 0.0:
        for s in range(n):
            diagonal[s] = 1e-6
        for e in range(len(a)):
            diagonal[a[e]] += weight[e]
            diagonal[b[e]] += weight[e]
            r = weight[e] * (rise[e] - x[b[e]] + x[a[e]])
            residual[b[e]] += r
            residual[a[e]] -= r
        norm = 0.0
        for s in range(n):
            step[s] = residual[s] / diagonal[s]
            norm += residual[s] * step[s]
    for _ in range(rounds):
        if norm < SETTLED:
            break
        for s in range(n):
            image[s] = 1e-6 * step[s]
        for e in range(len(a)):
            r = weight[e] * (step[b[e]] - step[a[e]])
            image[b[e]] += r
            image[a[e]] -= r
        along = 0.0
        for s in range(n):
            along += step[s] * image[s]
        length, old, norm = norm / along, norm, 0.0
        for s in range(n):
            x[s] += length * step[s]
            residual[s] -= length * image[s]
            norm += residual[s] * (residual[s] / diagonal[s])
        for s in range(n):
            step[s] = residual[s] / diagonal[s] + norm / old * step[s]
    return norm


@kernel
def _climb(
    points: NDArray[np.float64],
    cost_model: CostModel,
    allowed: NDArray[np.bool_],
    pred_start: NDArray[np.int32],
    succ_start: NDArray[np.int32],
    succ: NDArray[np.int32],
    start: int,
    penalty: NDArray[np.float64],
) -> NDArray[np.int32]:
    """Greedy from the oriented toolpath ``start`` by cost of travel plus penalty, float64 (n,).

    Looks at each printable toolpath in each step: there are few, at most two in a column for gentle tilts.
    """
    n = len(pred_start) - 1
    missing = pred_start[1:] - pred_start[:-1]
    ready = np.empty(n, np.int32)
    count = 0
    for s in range(n):
        if missing[s] == 0:
            ready[count] = s
            count += 1
    sequence = np.empty(n, np.int32)
    u = start
    for k in range(n):
        if k > 0:
            least = np.inf
            x, y = points[u ^ 1, 0], points[u ^ 1, 1]
            for t in range(count):
                for v in range(2 * ready[t], 2 * ready[t] + 2):
                    if not allowed[v >> 1, v & 1]:
                        continue
                    cost = direct_cost(cost_model, points[v, 0] - x, points[v, 1] - y) + penalty[v >> 1]
                    if cost < least:
                        least, u = cost, v
        sequence[k] = u
        s = u >> 1
        for t in range(count):
            if ready[t] == s:
                count -= 1
                ready[t] = ready[count]
                break
        for t in range(succ_start[s], succ_start[s + 1]):
            missing[succ[t]] -= 1
            if missing[succ[t]] == 0:
                ready[count] = succ[t]
                count += 1
    return sequence
