"""A beam over the down-sets of a large sheet, guided by the values of all pairs of neighbouring columns.

The same search as in ``layers`` without a graph of states: a node is a down-set of each column, the last
toolpath and its direction, and what is to come is looked up in the values of ``streamed_dp``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound import Layout, StateValues
from slicer.sequence.layered.node_pool import (
    BOUND,
    COST,
    LAST,
    PARENT,
    NodePool,
    doubled,
    drop_dominated,
    insert,
    keep_best,
    rebuild_table,
)
from slicer.sequence.layered.streamed_nodes import Beam
from slicer.sequence.problem import scrambled
from slicer.sequence.states import NONE

REACH = 8
"""Columns to either side of the nozzle where successors are looked for first; all, if there are none."""


class Around(NamedTuple):
    """Sums of the values of pairs of columns within reach, if the nozzle is in another column.

    Attributes:
        passed, ahead: float64 (c,), those of the pairs left of that column, and right of it.
    """

    passed: NDArray[np.float64]
    ahead: NDArray[np.float64]


class _Place(NamedTuple):
    """Where an advancing beam is.

    Attributes:
        layer, node: whose successors are next.
        size: nodes of the next layer in the pool.
        cut: nodes whose bound is above it are dropped from that layer.
        generated: successors looked at.
    """

    layer: int
    node: int
    size: int
    cut: float
    generated: int


@kernel
def advance(
    layout: Layout, known: StateValues, beam: Beam, pool: NodePool, span: tuple[int, int], width: int
) -> tuple[NodePool, int, int]:
    """Take a beam from layer ``span[0]`` to layer ``span[1]``.

    Returns:
        (the pool, the layer it has come to, the successors generated): an earlier layer where nothing of it
        has a successor among the states that are looked at.
    """
    # No loop over nodes in here, see ``expand_layers``.
    columns = len(layout.begin) - 1
    around = Around(np.empty(columns + 1), np.empty(columns + 1))
    if span[0] == 0:
        _begin(layout, known, beam, around)
    rebuild_table(pool, 0)
    place = _Place(span[0], 0, 0, np.inf, 0)
    while True:
        place, full = _advance(layout, known, beam, pool, around, place, span[1], width)
        if not full:
            return pool, place.layer, place.generated
        pool = doubled(pool, place.size)


@inner_kernel
def _advance(
    layout: Layout,
    known: StateValues,
    beam: Beam,
    pool: NodePool,
    around: Around,
    place: _Place,
    end: int,
    width: int,
) -> tuple[_Place, bool]:
    """Take a beam to layer ``end``, or as far as the pool has room; whether that is what ended it.

    A node whose successors have no room begins anew in a larger pool, which leaves those that are there.
    """
    columns = len(layout.begin) - 1
    room = 4 * width
    begun, first, size, cut, generated = place
    for at in range(begun, end):
        here = at & 1
        for a in range(first, beam.last.shape[1]):
            u = beam.last[at, a]
            if u == NONE:
                break
            state, own = beam.state[here, a], layout.column[u >> 1]
            x, y = layout.point[u ^ 1, 0], layout.point[u ^ 1, 1]
            before = generated
            for reach in (REACH, columns):
                low, high = max(0, own - reach), min(columns - 1, own + reach)
                _look_around(layout, known, state, low, high, around)
                common = beam.rest[a] - around.passed[own] - around.ahead[own]
                common -= _value_at(layout, known, state, own, state[own], _top_of(layout, state[own], u))
                for k in range(low, high + 1):
                    rest_k = common + around.passed[k] + around.ahead[k]
                    for e in range(layout.step_start[state[k]], layout.step_start[state[k] + 1]):
                        to, path = layout.step_to[e], layout.step_path[e]
                        if not _are_near(layout, known, state, k, to):
                            continue
                        for f in range(2):
                            if not layout.allowed[2 * path + f]:
                                continue
                            dx = layout.point[2 * path + f, 0] - x
                            dy = layout.point[2 * path + f, 1] - y
                            cost = beam.cost[a] + np.sqrt(dx * dx + dy * dy)
                            top = 2 * layout.step_slot[e] + f
                            bound = cost + rest_k + _value_at(layout, known, state, k, to, top)
                            generated += 1
                            if bound <= cut and bound < np.inf:
                                if size == len(pool.key):
                                    return _Place(at, a, size, cut, before), True
                                key = beam.key[a] ^ scrambled(path + 1)
                                size = insert(pool, size, key, 2 * path + f, a, cost, bound)
                if generated > before or high - low + 1 == columns:
                    break
            if size > room:
                cut = keep_best(pool, size, width)[1]
                size = width
                rebuild_table(pool, size)
        if size == 0:
            return _Place(at, 0, 0, cut, generated), False
        size = drop_dominated(pool, layout.point.reshape(-1, 2, 2), size)
        if size > width:
            keep_best(pool, size, width)
            size = width
        _enter(layout, beam, pool, size, at + 1)
        rebuild_table(pool, 0)
        first, size, cut = 0, 0, np.inf
    return _Place(end, 0, 0, cut, generated), False


@inner_kernel
def _begin(layout: Layout, known: StateValues, beam: Beam, around: Around) -> None:
    """Fill in what the starts have before them."""
    for a in range(beam.last.shape[1]):
        u = beam.last[0, a]
        if u == NONE:
            break
        state, own = beam.state[0, a], layout.column[u >> 1]
        _look_around(layout, known, state, 0, len(state) - 1, around)
        value = _value_at(layout, known, state, own, state[own], _top_of(layout, state[own], u))
        beam.rest[a] = around.passed[own] + around.ahead[own] + value
        beam.key[a] = scrambled((u >> 1) + 1)


@inner_kernel
def _top_of(layout: Layout, s: int, u: int) -> int:
    """The place of the oriented toolpath u among the oriented maximal elements of down-set s."""
    t = layout.top_start[s]
    while layout.top_path[t] != u >> 1:
        t += 1
    return int(2 * (t - layout.top_start[s]) + (u & 1))


@inner_kernel
def _look_around(
    layout: Layout, known: StateValues, state: NDArray[np.int32], low: int, high: int, around: Around
) -> None:
    """Fill in the sums of the columns low .. high, over the pairs that have one of these."""
    around.passed[low] = around.ahead[high] = 0.0
    for k in range(low, high):
        around.passed[k + 1] = around.passed[k]
        if k > 0:
            at = known.states.outside[state[k - 1]] + 2 * (state[k] - layout.set_start[k])
            around.passed[k + 1] += known.outside[at + 1]
    for k in range(high, low, -1):
        around.ahead[k - 1] = around.ahead[k]
        if k + 1 < len(state):
            at = known.states.outside[state[k]] + 2 * (state[k + 1] - layout.set_start[k + 1])
            around.ahead[k - 1] += known.outside[at]


@inner_kernel
def _are_near(layout: Layout, known: StateValues, state: NDArray[np.int32], k: int, to: int) -> bool:
    """Whether down-set ``to`` of column k is looked at together with those of its neighbours."""
    states = known.states
    if k > 0:
        j = to - layout.set_start[k]
        if j < states.low[state[k - 1]] or j >= states.high[state[k - 1]]:
            return False
    if k + 1 < len(state):
        j = state[k + 1] - layout.set_start[k + 1]
        return bool(states.low[to] <= j < states.high[to])
    return True


@inner_kernel
def _value_at(
    layout: Layout, known: StateValues, state: NDArray[np.int32], k: int, to: int, top: int
) -> float:
    """The values of the pairs of column k, at whose down-set ``to`` the nozzle is after a maximal element."""
    states = known.states
    value = 0.0
    if k > 0:
        t = 2 * (layout.top_start[to] - layout.top_start[layout.set_start[k]]) + top
        value += known.right[states.right[state[k - 1]] + t]
    if k + 1 < len(state):
        j = state[k + 1] - layout.set_start[k + 1]
        value += known.left[states.left[to] + top * (states.high[to] - states.low[to]) + j]
    return value


@inner_kernel
def _enter(layout: Layout, beam: Beam, pool: NodePool, size: int, at: int) -> None:
    """Make the nodes of the pool, the most promising first, the layer ``at`` of the beam."""
    for a in range(size):  # sorted by insertion: they are few
        q = a
        while q > 0 and pool.number[pool.chain[q - 1], BOUND] > pool.number[a, BOUND]:
            pool.chain[q] = pool.chain[q - 1]
            q -= 1
        pool.chain[q] = a
    for q in range(size):
        a = pool.chain[q]
        parent, v = pool.tag[a, PARENT], pool.tag[a, LAST]
        beam.parent[at, q], beam.last[at, q] = parent, v
        for k in range(beam.state.shape[2]):
            s = beam.state[1 - (at & 1), parent, k]
            if layout.begin[k] <= v >> 1 < layout.begin[k + 1]:
                e = layout.step_start[s]
                while layout.step_path[e] != v >> 1:
                    e += 1
                s = layout.step_to[e]
            beam.state[at & 1, q, k] = s
    for q in range(size):
        a = pool.chain[q]
        beam.key[q], beam.cost[q] = pool.key[a], pool.number[a, COST]
        beam.rest[q] = pool.number[a, BOUND] - pool.number[a, COST]
