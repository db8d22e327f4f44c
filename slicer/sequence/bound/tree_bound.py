"""A bound for sheets of any size: the cheapest tree that joins all toolpaths (Held and Karp).

The travels of a sequence join all toolpaths, so they cost no less than the cheapest spanning tree. In a tree
many travels may meet at one endpoint, where a sequence has one, or none at its beginning and its end: each
endpoint has a multiplier that is paid for every travel there, and taken off once (Held and Karp, "The
traveling-salesman problem and minimum spanning trees", Operations Research 18, 1970). Where something must be
printed between two toolpaths, no travel joins them, which under a nozzle's body leaves a third of those that
are near; the rest of the precedence is not seen, so that other bounds are tighter where there are any.

Only travels up to a distance are listed. All others together are as good as one star: each is taken for as
cheap as one of that distance, and of a complete graph whose edges cost the sum of what their ends do, a star
around the cheapest is the cheapest tree.
"""

import numpy as np
import shapely
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.sequence.problem import (
    CostModel,
    Problem,
    Search,
    ancestors,
    is_ancestor,
    least_travel_cost,
    leg_cost,
    realizer,
)

STEPS = {"quick": 100, "default": 300, "high": 1_000}
WORK = {"quick": 10_000_000, "default": 100_000_000, "high": 1_000_000_000}
"""Listed travels in all steps, at about 80 ns each."""
CHEAP = {"quick": "quick", "default": "quick", "high": "default"}
"""Of which effort the steps are for methods that have no bound of their own."""
LATE_UP_TO = 20_000
"""Toolpaths up to which they get one even where no time is left: one step takes less than half a second."""
NEARLY = 1.2
"""The ascent aims at no more than so many times its bound: towards the cost of a poor sequence its steps are
so long that the bound hardly rises (10x10_s1, greedy: 37.0 s after 100 steps, against 40.2)."""
FIRST_STEP = 0.2
MOMENTUM = 0.7
SHRINK, PATIENCE, GAIN = 0.7, 15, 2e-3
"""Steps become shorter after so many that gain less than this part of the remaining gap."""
REACH = 4.0
"""Travels are listed up to so many times the distance between endpoints on average,"""
MOST_LISTED = 40
"""or less where there would be more than so many for each endpoint."""
MOST_WITH_ANCESTORS = 50_000
"""Toolpaths up to which all that must come before each is found where a body orders them: 310 MB."""
UNLIMITED = 1e9


def raise_tree_bound(search: Search, effort: str | None = None) -> None:
    """Raise a search's bound by as many steps as the effort, its own by default, allows; at least one."""
    if search.problem.n < 2:
        return
    effort = search.effort if effort is None else effort
    tree = TreeBound(search.problem, search.objective.cost_model)
    listed = len(tree.ends) + search.problem.n
    tree.improve(search.cost)
    for _ in range(max(2, min(STEPS[effort], WORK[effort] // listed)) - 1):
        if search.should_stop():
            break
        tree.improve(min(search.cost, NEARLY * tree.bound))
    search.raise_bound_on_all(tree.bound)
    search.report("bound")


def raise_cheap_bound(search: Search) -> None:
    """Give a search without a bound one, whatever its method was, in little time beside that of the method.

    Where no time is left it is that of a single step, or on the largest sheets none.
    """
    if search.lower_bound > 0.0 or search.proved or (search.late() and search.problem.n > LATE_UP_TO):
        return
    raise_tree_bound(search, CHEAP[search.effort])


class TreeBound:
    """The bound, as far as its multipliers have been improved.

    An endpoint's number is twice its toolpath's, plus 1 for the second one.

    Attributes:
        ends: int64 (m, 2), endpoints that travels up to ``reach_mm`` join.
        reach_mm: no travel that a sequence may have and that is not listed is shorter.
        multiplier: float64 (2n,), where the ascent is.
        bound: no sequence costs less.
    """

    def __init__(self, problem: Problem, cost_model: CostModel) -> None:
        """List the travels of a problem of two toolpaths at least."""
        self._n = problem.n
        points = problem.segments.reshape(-1, 2)
        self.ends, self.reach_mm = _near(problem, points)
        self._cost = np.empty(len(self.ends))
        travel_costs(points, cost_model, self.ends, self._cost)
        self._beyond = _least_cost(cost_model, self.reach_mm)
        self._first = None if problem.first is None else np.unique(problem.starts)
        self.multiplier = np.zeros(2 * self._n)
        self.bound = 0.0
        self._best, self._direction = self.multiplier, np.zeros(2 * self._n)
        self._step, self._stale = FIRST_STEP, 0

    def improve(self, target: float) -> None:
        """One step of the ascent towards ``target``, a cost that some sequence has."""
        bound, degree = self.evaluate()
        if bound > self.bound:
            self._stale = 0 if bound > self.bound + GAIN * (target - self.bound) else self._stale
            self.bound, self._best = bound, self.multiplier
        else:
            self._stale += 1
            if self._stale > PATIENCE:
                self._step, self._stale = SHRINK * self._step, 0
                self.multiplier, self._direction = self._best, np.zeros(2 * self._n)
                return
        self._direction = MOMENTUM * self._direction + (1 - MOMENTUM) * (degree - 1.0)
        norm = float((self._direction**2).sum())
        if norm > 0.0:
            self.multiplier = self.multiplier + self._step * (target - bound) / norm * self._direction

    def evaluate(self) -> tuple[float, NDArray[np.float64]]:
        """The bound at ``multiplier``, and float64 (2n,), the travels of the tree at each endpoint."""
        n, price = self._n, self.multiplier
        cheaper = 2 * np.arange(n) + (price[1::2] < price[::2])  # of each toolpath's endpoints
        middle = cheaper[price[cheaper].argmin()]
        star = np.stack([cheaper[cheaper != middle], np.full(n - 1, middle)], axis=1)
        ends = np.concatenate([self.ends, star])
        cost = np.concatenate([self._cost, np.full(n - 1, self._beyond)])
        weight = cost + price[ends[:, 0]] + price[ends[:, 1]]
        degree = np.zeros(2 * n)
        total = _span(ends, weight, np.argsort(weight), np.arange(n), degree)
        # A sequence is entered at one endpoint and left at another, where no travel is.
        low = np.argpartition(price, 1)[:2]
        if self._first is not None:
            entry = self._first[price[self._first].argmin()]
            low = np.array([entry, low[0] if low[0] != entry else low[1]])
        degree[low] += 1.0
        return total + float(price[low].sum() - price.sum()), degree


def _near(problem: Problem, points: NDArray[np.float64]) -> tuple[NDArray[np.int64], float]:
    """Pairs of endpoints that a travel of at most some distance may join, and that distance in mm."""
    extent = np.ptp(points, axis=0)
    reach = REACH * float(np.sqrt(max(extent.prod(), extent.max() ** 2 * 1e-3, 1e-12) / len(points)))
    where = shapely.points(points)
    tree = shapely.STRtree(where)
    sample = where[:: max(1, len(where) // 2000)]
    while len(tree.query(sample, predicate="dwithin", distance=reach)[0]) > MOST_LISTED * len(sample):
        reach *= 0.8
    a, b = tree.query(where, predicate="dwithin", distance=reach)
    chosen = a >> 1 < b >> 1
    a, b = a[chosen], b[chosen]
    may = _may_join(problem, a >> 1, b >> 1)
    return np.stack([a[may], b[may]], axis=1), reach


def _may_join(problem: Problem, s: NDArray[np.int64], t: NDArray[np.int64]) -> NDArray[np.bool_]:
    """bool (m,), whether some sequence may print toolpaths s and t (m,) one after the other.

    Not where one must come before the other by way of a third.
    """
    n = problem.n
    if problem.planar:
        rank, edges = realizer(problem), problem.below
        s_first = (rank[s] < rank[t]).all(axis=1)
        t_first = (rank[t] < rank[s]).all(axis=1)
    elif n <= MOST_WITH_ANCESTORS:
        ahead = ancestors(problem.pred_start, problem.pred, problem.succ_start, problem.succ)
        s_first, t_first = is_ancestor(ahead, t, s), is_ancestor(ahead, s, t)
        edges = np.stack([problem.pred, np.repeat(np.arange(n), np.diff(problem.pred_start))], axis=1)
    else:
        return np.ones(len(s), np.bool_)
    pairs = np.where(t_first, t * n + s, s * n + t)
    return ~(s_first | t_first) | np.isin(pairs, edges.astype(np.int64) @ np.array([n, 1]))


def _least_cost(cost_model: CostModel, length: float) -> float:
    """No travel of at least this length costs less, whatever its direction."""
    freely = cost_model._replace(
        speed_x=UNLIMITED, speed_y=UNLIMITED, acceleration_x=UNLIMITED, acceleration_y=UNLIMITED
    )
    cost = leg_cost(freely, length, 0.0)
    if cost_model.timed and length <= cost_model.join:
        cost = min(cost, length / cost_model.join_speed)
    return cost


@bare_kernel
def travel_costs(
    points: NDArray[np.float64], cost_model: CostModel, ends: NDArray[np.int64], out: NDArray[np.float64]
) -> None:
    """Fill ``out`` (m,) with the least cost of a travel between each pair of points, either way."""
    for k in range(len(ends)):
        a, b = ends[k, 0], ends[k, 1]
        dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        # A hop may be joined one way only.
        out[k] = min(least_travel_cost(cost_model, dx, dy), least_travel_cost(cost_model, -dx, -dy))


@bare_kernel
def _span(
    ends: NDArray[np.int64],
    weight: NDArray[np.float64],
    order: NDArray[np.int64],
    root: NDArray[np.int64],
    degree: NDArray[np.float64],
) -> float:
    """The weight of the cheapest tree (Kruskal), by edges in the ``order`` of their weights.

    Args:
        root: int64 (n,), 0 .. n - 1; changed in place.
        degree: float64 (2n,), to which the tree's edges at each endpoint are added.
    """
    total, left = 0.0, len(root) - 1
    for t in range(len(order)):
        k = order[t]
        a, b = ends[k, 0] >> 1, ends[k, 1] >> 1
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        if a == b:
            continue
        root[a] = b
        total += weight[k]
        degree[ends[k, 0]] += 1.0
        degree[ends[k, 1]] += 1.0
        left -= 1
        if left == 0:
            break
    return total
