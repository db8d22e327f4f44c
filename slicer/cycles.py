"""Which toolpaths stand in one another's way in a ring, so that none of them can be printed first."""

import numpy as np
from numpy.typing import NDArray

from slicer.errors import CycleError
from slicer.kernels import kernel


def components(n: int, edges: NDArray[np.int32]) -> NDArray[np.int32]:
    """Strongly connected components of a precedence, O(n + m): Tarjan's algorithm (SIAM J. Comput. 1, 1972).

    Args:
        n: the number of toolpaths.
        edges: int32 (m, 2), row (a, b): a is printed before b.

    Returns:
        int32 (n,), the component of each toolpath. Edges between components lead from higher numbers to
        lower ones.
    """
    ascending = edges[np.argsort(edges[:, 0], kind="stable")]
    start = np.zeros(n + 1, np.int32)
    np.cumsum(np.bincount(ascending[:, 0], minlength=n), out=start[1:])
    return _tarjan(start, np.ascontiguousarray(ascending[:, 1]))


def in_cycles(n: int, edges: NDArray[np.int32]) -> NDArray[np.bool_]:
    """bool (n,): which toolpaths lie in a cycle."""
    component = components(n, edges)
    return np.asarray((np.bincount(component, minlength=n) > 1)[component], np.bool_)


def groups(n: int, edges: NDArray[np.int32]) -> list[NDArray[np.intp]]:
    """The toolpaths, ascending, of each component of more than one, by their first ones."""
    component = components(n, edges)
    order = np.argsort(component, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(component[order])) + 1)
    return sorted((part for part in parts if len(part) > 1), key=lambda members: int(members[0]))


def check_acyclic(n: int, edges: NDArray[np.int32]) -> None:
    """Refuse a precedence in which toolpaths wait for one another.

    Raises:
        CycleError: it holds every component of more than one toolpath.
    """
    held = groups(n, edges)
    if held:
        raise CycleError(held)


@kernel
def _tarjan(start: NDArray[np.int32], succ: NDArray[np.int32]) -> NDArray[np.int32]:
    n = len(start) - 1
    index = np.full(n, -1, np.int32)
    low = np.empty(n, np.int32)
    component = np.full(n, -1, np.int32)
    path = np.empty(n, np.int32)  # from the root to where the search is
    next_edge = np.empty(n, np.int32)
    held = np.empty(n, np.int32)  # entered, and not yet in a component
    count = found = waiting = 0
    for root in range(n):
        if index[root] >= 0:
            continue
        depth = 1
        path[0] = root
        index[root] = low[root] = count
        count += 1
        next_edge[root] = start[root]
        held[waiting] = root
        waiting += 1
        while depth > 0:
            s = path[depth - 1]
            if next_edge[s] < start[s + 1]:
                t = succ[next_edge[s]]
                next_edge[s] += 1
                if index[t] < 0:
                    index[t] = low[t] = count
                    count += 1
                    next_edge[t] = start[t]
                    held[waiting] = t
                    waiting += 1
                    path[depth] = t
                    depth += 1
                elif component[t] < 0:
                    low[s] = min(low[s], index[t])
                continue
            depth -= 1
            if depth > 0:
                low[path[depth - 1]] = min(low[path[depth - 1]], low[s])
            if low[s] == index[s]:
                while True:
                    waiting -= 1
                    t = held[waiting]
                    component[t] = found
                    if t == s:
                        break
                found += 1
    return component
