"""Monte Carlo tree search over one stretch of a sequence after the other: the kernels of ``mcts``.

What stands before the root is printed, and the toolpaths of the stretch behind it may be ordered anew, with
nothing between them that the order of the rest depends on. A node is a printable order of some of them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.local_search import LEAST_GAIN, REACH, Tour, descend, refresh
from slicer.sequence.problem import FORBIDDEN, arc_cost, draw
from slicer.sequence.tree_search.tree import (
    ENTRY,
    NONE,
    add_child,
    add_node,
    backpropagate,
    is_child,
    may_widen,
    select,
)

STRETCH_LENGTH = 150
"""How many toolpaths a stretch has."""
CHILD_BIAS = 0.1
LEAST_BIAS, MOST_BIAS = 0.1, 0.5
"""How much later in the best sequence is as bad as a longer travel, in usual travels for each position."""
STRAY = 0.01
"""How often a rollout takes the second best toolpath."""


class Room(NamedTuple):
    """What one tree and its rollouts write to, made once for all trees.

    Attributes:
        missing: int32 (2, m), for each toolpath of the stretch, how many that it waits for are not printed:
            at the root, and now.
        ready: int32 (m,), the printable ones, by their position in the stretch.
        sequence: int32 (m,), the stretch as a rollout orders it.
        tree, worth: see ``tree``.
        path: int32, the nodes gone through.
    """

    missing: NDArray[np.int32]
    ready: NDArray[np.int32]
    sequence: NDArray[np.int32]
    tree: NDArray[np.int32]
    worth: NDArray[np.float64]
    path: NDArray[np.int32]


@kernel
def search_stretches(
    tour: Tour,
    state: NDArray[np.uint64],
    low: int,
    high: int,
    stride: int,
    rollouts: int,
) -> int:
    """Spend ``rollouts`` from a root at each ``stride``-th position of [low, high); the states created.

    Each rollout is repaired by descent, which may reach beyond the stretch. What is cheaper replaces the
    sequence, and the tree begins anew, since its costs were those of another stretch. See ``Tour`` for the
    arrays.
    """
    longest, order, cost = tour.longest, tour.order, tour.cost
    n = order.shape[1] - 2
    most = min(STRETCH_LENGTH, n)
    back = order[0].copy()
    queue, queued = np.empty(n, np.int32), np.zeros(n, np.bool_)
    span = np.empty(2, np.int64)
    spare = np.empty((max(longest, REACH), 3))
    room = Room(
        np.empty((2, most), np.int32),
        np.empty(most, np.int32),
        np.empty(most, np.int32),
        np.empty((rollouts + 1, 4), np.int32),
        np.empty((rollouts + 1, 3)),
        np.empty(rollouts + 2, np.int32),
    )
    sequence, worth, path = room.sequence, room.worth, room.path
    states = 0
    for root in range(low, high, stride):
        end = min(n + 1, root + STRETCH_LENGTH)
        made = 0
        before = 0.0
        for _ in range(rollouts):
            if made == 0:
                made = _new_tree(tour, room, root, end)
                before = _stretch(cost, root, end)
            made, depth, created = _rollout(tour, room, root, end, before, made, state)
            states += created
            count = _changed(tour, root, end, sequence, queue, queued)
            for k in range(end - root):
                order[0, root + k] = sequence[k]
            refresh(tour, root, end)
            span[0], span[1] = root, end
            gain = before - _stretch(cost, root, end)
            gain += descend(
                tour, queue, queued, count,
                span, spare,
            )  # fmt: skip
            if gain > LEAST_GAIN:
                for p in range(span[0], span[1]):
                    back[p] = order[0, p]
                made = 0
                continue
            for p in range(span[0], span[1]):
                order[0, p] = back[p]
            refresh(tour, span[0], span[1])
            for d in range(depth + 1):
                backpropagate(worth, path[d], -gain)
    return states


@inner_kernel
def _stretch(cost: NDArray[np.float64], root: int, end: int) -> float:
    """Cost of the travels into positions root .. end."""
    total = 0.0
    for p in range(root, end + 1):
        total += cost[0, p]
    return total


@inner_kernel
def _new_tree(
    tour: Tour,
    room: Room,
    root: int,
    end: int,
) -> int:
    """Make the tree a root alone; the number of its nodes."""
    missing, tree, worth = room.missing, room.tree, room.worth
    links, order = tour.links, tour.order
    for i in range(end - root):
        s = order[0, root + i] >> 1
        missing[0, i] = 0
        for t in range(links[2 * s], links[2 * s + 1]):
            missing[0, i] += order[1, links[t]] >= root
    return add_node(tree, worth, 0, order[0, root - 1])


@inner_kernel
def _rollout(
    tour: Tour,
    room: Room,
    root: int,
    end: int,
    before: float,
    made: int,
    state: NDArray[np.uint64],
) -> tuple[int, int, int]:
    """Go down the tree, add a node and complete the stretch: nodes, depth, and states created.

    Writes the stretch and the nodes gone through to the room.
    """
    missing, ready, sequence = room.missing, room.ready, room.sequence
    tree, worth, path = room.tree, room.worth, room.path
    order = tour.order
    m = end - root
    count = 0
    for i in range(m):
        missing[1, i] = missing[0, i]
        if missing[1, i] == 0:
            ready[count] = i
            count += 1
    usual = max(before / (m + 1), 1e-9)
    bias = usual * LEAST_BIAS * (MOST_BIAS / LEAST_BIAS) ** draw(state)
    node, depth, states = 0, 0, 0
    path[0] = 0
    u = order[0, root - 1]
    for k in range(m):
        states += 2 * count
        v = NONE
        if node != NONE:
            fresh = NONE
            if may_widen(tree, worth, node):
                fresh, _ = _best(tour, room, root, count, u, CHILD_BIAS * usual, node)
            if fresh != NONE:
                v, child = fresh, made
                made = add_child(tree, worth, node, made, v)
            else:
                child = select(tree, worth, node)
                if child != NONE:
                    v = tree[child, ENTRY]
            if child != NONE:
                depth += 1
                path[depth] = child
            node = NONE if fresh != NONE else child
        if v == NONE:
            v, second = _best(tour, room, root, count, u, bias, NONE)
            if second != NONE and draw(state) < STRAY:
                v = second
        sequence[k] = u = v
        count = _print(tour, room, root, m, count, v >> 1)
    return made, depth, states


@inner_kernel
def _best(
    tour: Tour,
    room: Room,
    root: int,
    count: int,
    u: int,
    bias: float,
    node: int,
) -> tuple[int, int]:
    """The two best printable oriented toolpaths after ``u`` that are no children of ``node``, or ``NONE``.

    Near is good, and so is early in the best sequence, whose large structure a rollout keeps.
    """
    ready, tree = room.ready, room.tree
    points, cost_model, order, allowed = tour.points, tour.cost_model, tour.order, tour.allowed
    least, next_least = FORBIDDEN, FORBIDDEN
    best, second = NONE, NONE
    for t in range(count):
        s = order[0, root + ready[t]] >> 1
        for v in range(2 * s, 2 * s + 2):
            if not allowed[v]:
                continue
            score = arc_cost(points, cost_model, u, v) + bias * ready[t]
            if score >= next_least:
                continue
            if node != NONE and is_child(tree, node, v):
                continue
            if score < least:
                least, next_least, best, second = score, least, v, best
            else:
                next_least, second = score, v
    return best, second


@inner_kernel
def _print(
    tour: Tour,
    room: Room,
    root: int,
    m: int,
    count: int,
    s: int,
) -> int:
    """Take toolpath ``s`` from the printable ones and add what it was under; how many there are then."""
    missing, ready = room.missing, room.ready
    links, order = tour.links, tour.order
    at = order[1, s] - root
    for t in range(count):
        if ready[t] == at:
            count -= 1
            ready[t] = ready[count]
            break
    for t in range(links[2 * s + 1], links[2 * s + 2]):
        above = order[1, links[t]] - root
        if above < m:
            missing[1, above] -= 1
            if missing[1, above] == 0:
                ready[count] = above
                count += 1
    return count


@inner_kernel
def _changed(
    tour: Tour,
    root: int,
    end: int,
    sequence: NDArray[np.int32],
    queue: NDArray[np.int32],
    queued: NDArray[np.bool_],
) -> int:
    """Queue the toolpaths at both ends of each travel that the sequence did not have; how many."""
    order = tour.order
    count = 0
    u = order[0, root - 1]
    for k in range(end - root + 1):
        v = sequence[k] if root + k < end else order[0, end]
        if v < 0:
            break
        q = order[1, v >> 1]
        kept = order[0, q] == v and order[0, q - 1] == u
        kept |= u >= 0 and order[0, q] == v ^ 1 and order[0, q + 1] == u ^ 1
        for w in (u, v):
            if not kept and w >= 0 and not queued[w >> 1]:
                queued[w >> 1] = True
                queue[count] = w >> 1
                count += 1
        u = v
    return count
