"""Print toolpaths whole that stand in one another's way, in the order that presses the least."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slicer import precedence
from slicer.cutting.hindering import hinders, lies_above
from slicer.cycles import components
from slicer.errors import SlicerError
from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import EPS_MM, NozzleBody, press_depth

EXACT_UP_TO = 14
"""Toolpaths of a component whose orders are all compared; of larger ones a good order is looked for."""

LARGEST = 4000
"""Toolpaths in one component: the depth of all of its pairs is held in memory."""


@dataclass(frozen=True, eq=False)
class RelaxedPrecedence:
    """What is printed though something is in the way.

    Attributes:
        edges: int32 (m, 2), the precedence without what is given up; row (a, b): a is printed before b.
        pairs: int32 (v, 2), row (a, b): b is printed though a, printed before it, stands in its way.
        depth_mm: float64 (v,), how deep a pushes into the nozzle's body there.
        least: whether no order presses less in total, beyond what may be pressed.
    """

    edges: NDArray[np.int32]
    pairs: NDArray[np.int32]
    depth_mm: NDArray[np.float64]
    least: bool


def press(segments: NDArray[np.float64], body: NozzleBody) -> RelaxedPrecedence:
    """Give up the precedence that costs least total pressing beyond ``body.press``, so that an order exists.

    What lies straight above stays above: the tip itself is never driven through printed material.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        body: the nozzle.

    Raises:
        CrossingError: two toolpaths cross.
        SlicerError: a component has more toolpaths than can be compared.
    """
    edges = precedence.hindering_edges(segments, body)
    component = components(len(segments), edges)
    size = np.bincount(component, minlength=1)
    members = np.flatnonzero(size[component] > 1)
    if len(members) == 0:
        return RelaxedPrecedence(edges, np.empty((0, 2), np.int32), np.empty(0), True)
    pairs, depths, least = [], [], True
    for group in np.flatnonzero(size > 1):
        of = np.flatnonzero(component == group)
        if len(of) > LARGEST:
            raise SlicerError(
                f"{len(of)} toolpaths wait for one another, but no more than {LARGEST} can be compared. "
                "Take a narrower nozzle, or have toolpaths cut (--conflicts cut)."
            )
        depth, above = _pressing(body, np.ascontiguousarray(segments[of]))
        excess = np.where(depth > body.press + EPS_MM, depth - body.press, 0.0)
        excess[above] = np.inf
        order = _all_orders(excess) if len(of) <= EXACT_UP_TO else _insertion(excess)
        least &= len(of) <= EXACT_UP_TO
        place = np.empty(len(of), np.int64)
        place[order] = np.arange(len(of))
        printed, hindered = np.nonzero((excess > 0) & (place[:, None] < place[None, :]))
        pairs.append(np.stack([of[printed], of[hindered]], axis=1))
        depths.append(depth[printed, hindered])
    given_up = np.concatenate(pairs).astype(np.int32)
    # The sparse edges of these toolpaths lead through one another: what is left of them is said pair by pair.
    inside = component[edges[:, 0]] == component[edges[:, 1]]
    direct = _edges_of(body, np.ascontiguousarray(segments), members)
    rows = np.unique(np.concatenate([edges[~inside], direct]), axis=0)
    n = len(segments)
    broken = given_up[:, 1].astype(np.int64) * n + given_up[:, 0]  # b was to be printed before a
    kept = rows[~np.isin(rows[:, 0].astype(np.int64) * n + rows[:, 1], broken)]
    return RelaxedPrecedence(np.ascontiguousarray(kept, np.int32), given_up, np.concatenate(depths), least)


@kernel
def _pressing(
    body: NozzleBody, segments: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(how deep [a], printed, pushes into the body while [b] is printed, whether [a] lies above [b])."""
    n = len(segments)
    depth, above = np.zeros((n, n)), np.zeros((n, n), np.bool_)
    for a in range(n):
        for b in range(n):
            if a != b:
                depth[a, b] = press_depth(body, segments[a], segments[b])
                above[a, b] = lies_above(segments[a], segments[b])
    return depth, above


@kernel
def _edges_of(
    body: NozzleBody, segments: NDArray[np.float64], members: NDArray[np.int64]
) -> NDArray[np.int32]:
    """int32 (m, 2), the whole relation between ``members`` and all toolpaths, pair by pair."""
    n = len(segments)
    count = 0
    for fill in range(2):
        out = np.empty((count, 2), np.int32)
        count = 0
        for b in members:
            for c in range(n):
                if b == c:
                    continue
                if hinders(body, segments[b], segments[c]):
                    if fill == 1:
                        out[count, 0], out[count, 1] = c, b
                    count += 1
                if hinders(body, segments[c], segments[b]):
                    if fill == 1:
                        out[count, 0], out[count, 1] = b, c
                    count += 1
    return out


@kernel
def _all_orders(excess: NDArray[np.float64]) -> NDArray[np.int64]:
    """The cheapest order of few toolpaths: a dynamic programme over what is printed.

    Args:
        excess: float64 (n, n), what it costs to print [a] before [b].
    """
    n = len(excess)
    cost = np.full(1 << n, np.inf)
    last = np.zeros(1 << n, np.int64)
    cost[0] = 0.0
    for printed in range(1 << n):
        if cost[printed] == np.inf:
            continue
        for a in range(n):
            if printed >> a & 1:
                continue
            total = cost[printed]
            for b in range(n):
                if b != a and not printed >> b & 1:
                    total += excess[a, b]
            to = printed | 1 << a
            if total < cost[to]:
                cost[to], last[to] = total, a
    order = np.empty(n, np.int64)
    printed = (1 << n) - 1
    for k in range(n - 1, -1, -1):
        order[k] = last[printed]
        printed ^= 1 << last[printed]
    return order


@kernel
def _insertion(excess: NDArray[np.float64]) -> NDArray[np.int64]:
    """A good order: what presses least on the rest goes next, then each is moved to where it costs least."""
    n = len(excess)
    order = np.empty(n, np.int64)
    left = np.ones(n, np.bool_)
    for k in range(n):
        best, best_cost = -1, np.inf
        for a in range(n):
            if left[a]:
                total = 0.0
                for b in range(n):
                    if left[b] and b != a:
                        total += excess[a, b]
                if best < 0 or total < best_cost:
                    best, best_cost = a, total
        order[k] = best
        left[best] = False
    improved = True
    while improved:
        improved = False
        for k in range(n):
            to, gain = _best_place(excess, order, k)
            if gain > 1e-9:
                _move(order, k, to)
                improved = True
    return order


@inner_kernel
def _best_place(excess: NDArray[np.float64], order: NDArray[np.int64], k: int) -> tuple[int, float]:
    """Where the k-th of an order should stand, and what that saves."""
    a = order[k]
    best, best_gain = k, 0.0
    gain = 0.0
    for q in range(k + 1, len(order)):  # a goes behind what stands there
        b = order[q]
        if excess[b, a] == np.inf:
            break
        gain += excess[a, b] - excess[b, a]
        if gain > best_gain:
            best, best_gain = q, gain
    gain = 0.0
    for q in range(k - 1, -1, -1):
        b = order[q]
        if excess[a, b] == np.inf:
            break
        gain += excess[b, a] - excess[a, b]
        if gain > best_gain:
            best, best_gain = q, gain
    return best, best_gain


@inner_kernel
def _move(order: NDArray[np.int64], k: int, to: int) -> None:
    a = order[k]
    step = 1 if to > k else -1
    q = k
    while q != to:
        order[q] = order[q + step]
        q += step
    order[to] = a
