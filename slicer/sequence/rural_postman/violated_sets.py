"""Which sets of ends or of toolpaths too few travels leave, in a solution in parts of a relaxation.

Travels grow into sets in falling order of their parts, as in Kruskal's tree, and each set on the way is
looked at. What that misses is found exactly: among ends by a cut tree (Gomory and Hu, SIAM Journal 9, 1961,
as Gusfield builds it, SIAM Journal on Computing 19, 1990), whose cuts hold the least odd one (Padberg and
Rao, Mathematics of Operations Research 7, 1982); among toolpaths by a least cut (Stoer and Wagner, Journal
of the ACM 44, 1997).
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel

MOST_SETS = 4_000
LEAST_VIOLATION = 1e-4
ALL_OF_IT = 1.0 - 1e-7
LARGEST_TREE = 400
"""Ends of a part of the solution for which a cut tree is built, which takes the cube of them."""
LARGEST_CUT = 1_500
"""Toolpaths, or chains of them, among which a least cut is looked for."""

Sets = list[NDArray[np.int64]]


def growing_sets(nodes: int, edges: NDArray[np.int64], part: NDArray[np.float64], *, odd: bool) -> Sets:
    """Sets of nodes that less than 1 (odd sets) or 2 (all sets) leaves, met while edges grow into sets.

    Args:
        edges: int64 (m, 2), nodes.
        part: float64 (m,), how much of each edge there is.
        odd: whether sets of an odd number of nodes are meant.
    """
    start = np.zeros(MOST_SETS + 1, np.int64)
    item = np.empty(100 * MOST_SETS, np.int64)
    order = np.argsort(-part, kind="stable")
    count = _grow(nodes, edges, part, order, odd, start, item)
    return [item[start[k] : start[k + 1]].copy() for k in range(count)]


def odd_sets(nodes: int, edges: NDArray[np.int64], part: NDArray[np.float64]) -> Sets:
    """Odd sets of nodes that less than 1 leaves: none only if there are none in parts up to ``LARGEST_TREE``.

    ``edges`` and ``part`` as for ``growing_sets``; every node has edges of 1 in all.
    """
    split = part < ALL_OF_IT
    edges, part = edges[split], part[split]
    label = _components(nodes, edges)
    by_label, by_edge = np.argsort(label, kind="stable"), np.argsort(label[edges[:, 0]], kind="stable")
    sizes = np.bincount(label)
    edge_sizes = np.bincount(label[edges[:, 0]], minlength=len(sizes))
    at, edge_at = np.cumsum(sizes) - sizes, np.cumsum(edge_sizes) - edge_sizes
    local = np.empty(nodes, np.int64)
    found: Sets = []
    for c in np.flatnonzero((sizes >= 4) & (sizes <= LARGEST_TREE)):
        members = by_label[at[c] : at[c] + sizes[c]]
        inside = by_edge[edge_at[c] : edge_at[c] + edge_sizes[c]]
        local[members] = np.arange(len(members))
        capacity = np.zeros((len(members), len(members)))
        a, b = local[edges[inside, 0]], local[edges[inside, 1]]
        capacity[a, b] = capacity[b, a] = part[inside]
        side = np.zeros(capacity.shape, np.bool_)
        value = np.full(len(members), np.inf)
        _cut_tree(capacity, side, value)
        low = (value < 1.0 - LEAST_VIOLATION) & (side.sum(axis=1) % 2 == 1)
        found += [members[row] for row in side[low]]
    return found


def least_left(nodes: int, edges: NDArray[np.int64], part: NDArray[np.float64]) -> Sets:
    """The set of nodes that is left least, if that is less than 2."""
    label = _components(nodes, edges[part >= ALL_OF_IT])
    chains = int(label.max()) + 1
    if not 1 < chains <= LARGEST_CUT:
        return []
    weight = np.zeros((chains, chains))
    a, b = label[edges[:, 0]], label[edges[:, 1]]
    apart = a != b
    np.add.at(weight, (a[apart], b[apart]), part[apart])
    np.add.at(weight, (b[apart], a[apart]), part[apart])
    inside = np.zeros(chains, np.bool_)
    value = _least_cut(weight, inside)
    return [np.flatnonzero(inside[label])] if value < 2.0 - LEAST_VIOLATION else []


def components(nodes: int, edges: NDArray[np.int64]) -> Sets:
    """The nodes of each connected part."""
    label = _components(nodes, edges)
    return np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label))[:-1])


def _components(nodes: int, edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """int64 (nodes,), which connected part each node is in."""
    root = np.arange(nodes)
    _join(edges, root)
    return np.unique(root, return_inverse=True)[1].reshape(-1).astype(np.int64)


@kernel
def _join(edges: NDArray[np.int64], root: NDArray[np.int64]) -> None:
    for k in range(len(edges)):
        root[root_of(root, edges[k, 0])] = root_of(root, edges[k, 1])
    for i in range(len(root)):
        root[i] = root_of(root, i)


@inner_kernel
def root_of(root: NDArray[np.int64], at: int) -> int:
    """What stands for the set that something is in; the way there is halved for who asks next."""
    while root[at] != at:
        root[at] = root[root[at]]
        at = root[at]
    return at


@kernel
def _grow(
    nodes: int,
    edges: NDArray[np.int64],
    part: NDArray[np.float64],
    order: NDArray[np.int64],
    odd: bool,
    start: NDArray[np.int64],
    item: NDArray[np.int64],
) -> int:
    """Fill ``start`` and ``item`` with the sets found; how many."""
    m = len(edges)
    root, tail, size = np.arange(nodes), np.arange(nodes), np.ones(nodes, np.int64)
    after, head, link = np.full(nodes, -1), np.full(nodes, -1), np.full(2 * m, -1)
    leaving = np.zeros(nodes)
    for e in range(m):
        for side in range(2):
            at = edges[e, side]
            link[2 * e + side] = head[at]
            head[at] = 2 * e + side
            leaving[at] += part[e]
    least = (1.0 if odd else 2.0) - LEAST_VIOLATION
    count, fill = 0, 0
    for k in range(m):
        u, v = root_of(root, edges[order[k], 0]), root_of(root, edges[order[k], 1])
        if u == v:
            continue
        if size[u] < size[v]:
            u, v = v, u
        between, w = 0.0, v
        while w >= 0:
            t = head[w]
            while t >= 0:
                if root_of(root, edges[t >> 1, 1 - (t & 1)]) == u:
                    between += part[t >> 1]
                t = link[t]
            w = after[w]
        root[v] = u
        after[tail[u]] = v
        tail[u] = tail[v]
        size[u] += size[v]
        leaving[u] += leaving[v] - 2.0 * between
        if leaving[u] >= least or size[u] == nodes or (odd and size[u] % 2 == 0):
            continue
        if count == len(start) - 1 or fill + size[u] > len(item):
            break
        w = u
        while w >= 0:
            item[fill] = w
            fill += 1
            w = after[w]
        count += 1
        start[count] = fill
    return count


@kernel
def _cut_tree(capacity: NDArray[np.float64], side: NDArray[np.bool_], value: NDArray[np.float64]) -> None:
    """Fill in cuts of a cut tree, one for each node but its root: a side, and what leaves it."""
    n = len(capacity)
    parent = np.zeros(n, np.int64)
    for s in range(1, n):
        t = parent[s]
        value[s] = _flow(capacity, s, t, side[s])
        for i in range(n):
            if i != s and side[s, i] and parent[i] == t:
                parent[i] = s
        if side[s, parent[t]]:
            parent[s], parent[t] = parent[t], s
    # What hangs under a node is one side of its cut; where that is odd it takes the place of the flow's side.
    below = np.zeros((n, n), np.bool_)
    for i in range(n):
        at = i
        while parent[at] != at:
            below[at, i] = True
            at = parent[at]
    for s in range(n):
        odd, leaving = False, 0.0
        for i in range(n):
            odd ^= below[s, i]
            for j in range(n):
                if below[s, i] and not below[s, j]:
                    leaving += capacity[i, j]
        if odd:
            value[s] = leaving
            for i in range(n):
                side[s, i] = below[s, i]


@allocating_inner_kernel
def _flow(capacity: NDArray[np.float64], s: int, t: int, side: NDArray[np.bool_]) -> float:
    """The greatest flow from s to t by shortest paths, and the side of s in a least cut."""
    n = len(capacity)
    left = capacity.copy()
    came, queue = np.empty(n, np.int64), np.empty(n, np.int64)
    total = 0.0
    while True:
        for i in range(n):
            came[i] = -1
        came[s], queue[0] = s, s
        at, end = 0, 1
        while at < end and came[t] < 0:
            u = queue[at]
            at += 1
            for v in range(n):
                if came[v] < 0 and left[u, v] > 1e-9:
                    came[v] = u
                    queue[end] = v
                    end += 1
        if came[t] < 0:
            break
        most, v = np.inf, t
        while v != s:
            most = min(most, left[came[v], v])
            v = came[v]
        v = t
        while v != s:
            left[came[v], v] -= most
            left[v, came[v]] += most
            v = came[v]
        total += most
    for i in range(n):
        side[i] = came[i] >= 0
    return total


@kernel
def _least_cut(weight: NDArray[np.float64], inside: NDArray[np.bool_]) -> float:
    """The value of the least cut, and one side of it; ``weight`` is used up."""
    n = len(weight)
    alive, done = np.ones(n, np.bool_), np.empty(n, np.bool_)
    group = np.zeros((n, n), np.bool_)
    key = np.empty(n)
    for i in range(n):
        group[i, i] = True
    best = np.inf
    for phase in range(n - 1):
        for i in range(n):
            key[i], done[i] = 0.0, not alive[i]
        last, before = -1, -1
        for _ in range(n - phase):
            pick = -1
            for i in range(n):
                if not done[i] and (pick < 0 or key[i] > key[pick]):
                    pick = i
            done[pick] = True
            before, last = last, pick
            for i in range(n):
                if not done[i]:
                    key[i] += weight[pick, i]
        if key[last] < best:
            best = key[last]
            for i in range(n):
                inside[i] = group[last, i]
        for i in range(n):
            weight[before, i] += weight[last, i]
            weight[i, before] += weight[i, last]
            group[before, i] |= group[last, i]
        weight[before, before] = 0.0
        alive[last] = False
    return best
