"""Edges of a precedence that follow from others, as far as a few steps show it.

The whole precedence may have cycles, in which edges could imply one another in a ring. So an edge from b to a
is left out for two reasons alone. First, b comes before some c straight below a, or some c straight above b
comes before a: this c is nearer to the other end of the edge in every order of "is below", which has no
cycles. Second, a way leads from b to a on which every step goes to another strongly connected component.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.cycles import components
from slicer.kernels import inner_kernel, kernel

STEPS = 4
"""So long are the ways that are looked for; longer ones leave out few edges more."""


class Lists(NamedTuple):
    """A list of toolpaths of each toolpath s: ``of[start[s]:start[s + 1]]``, both int32."""

    start: NDArray[np.int32]
    of: NDArray[np.int32]

    @classmethod
    def grouped(cls, by: NDArray[np.int32], values: NDArray[np.int32], n: int) -> "Lists":
        """Group ``values`` by the toolpath in ``by``."""
        start = np.zeros(n + 1, np.int32)
        np.cumsum(np.bincount(by, minlength=n), out=start[1:])
        return cls(start, np.ascontiguousarray(values[np.argsort(by, kind="stable")]))


def without_implied(below: NDArray[np.int32], hindered: Lists) -> NDArray[np.int32]:
    """Add to "is below" what toolpaths hinder, but for most of what follows from the rest.

    Args:
        below: int32 (m, 2), the covering relation of "is below", row (b, a): b lies below a.
        hindered: of each toolpath a those that it would hinder, which come before it.

    Returns:
        int32 (k, 2), rows (b, a), sorted.
    """
    n = len(hindered.start) - 1
    under = Lists.grouped(below[:, 1], below[:, 0], n)
    over = Lists.grouped(below[:, 0], below[:, 1], n)
    keep = _needed(under, over, hindered)
    later = np.repeat(np.arange(n, dtype=np.int32), np.diff(hindered.start))
    rows = np.concatenate([below, np.stack([hindered.of[keep], later[keep]], axis=1)])
    rows = rows[np.argsort(rows[:, 1], kind="stable")]
    plain = _is_row_of(below, rows, n)
    start = np.searchsorted(rows[:, 1], np.arange(n + 1)).astype(np.int32)
    before = Lists(start, np.ascontiguousarray(rows[:, 0]))
    rows = rows[plain | ~_ways_around(before, plain, components(n, rows), STEPS)]
    return np.ascontiguousarray(rows[np.lexsort((rows[:, 1], rows[:, 0]))], np.int32)


def _is_row_of(some: NDArray[np.int32], rows: NDArray[np.int32], n: int) -> NDArray[np.bool_]:
    return np.isin(rows[:, 0] * np.int64(n) + rows[:, 1], some[:, 0] * np.int64(n) + some[:, 1])


@kernel
def _ways_around(
    before: Lists, plain: NDArray[np.bool_], component: NDArray[np.int32], steps: int
) -> NDArray[np.bool_]:
    """bool (m,): whether another way of at most so many steps, all between components, says the same.

    It is looked for as long as edges that are not ``plain`` want one.
    """
    start, of = before.start, before.of
    n = len(start) - 1
    around = np.zeros(len(of), np.bool_)
    reached = np.full(n, -1, np.int32)  # a: in two steps or more from toolpath a
    wanted = np.zeros(n, np.bool_)
    queue = np.empty(2 * n, np.int32)
    for a in range(n):
        done = end = wanting = 0
        for i in range(start[a], start[a + 1]):
            wanted[of[i]] = not plain[i]
            wanting += not plain[i]
            if component[of[i]] != component[a]:
                queue[end] = of[i]
                end += 1
        for _ in range(steps - 1):
            level = end
            while done < level and wanting > 0:
                c = queue[done]
                done += 1
                for i in range(start[c], start[c + 1]):
                    b = of[i]
                    if reached[b] != a and component[b] != component[c]:
                        reached[b] = a
                        wanting -= wanted[b]
                        queue[end] = b
                        end += 1
        for i in range(start[a], start[a + 1]):
            around[i] = reached[of[i]] == a
            wanted[of[i]] = False
    return around


@kernel
def _needed(under: Lists, over: Lists, hindered: Lists) -> NDArray[np.bool_]:
    n = len(hindered.start) - 1
    keep = np.ones(len(hindered.of), np.bool_)
    implied = np.full(n, -1, np.int32)  # a: comes before what lies below toolpath a
    before = np.full(n, -1, np.int32)  # a: comes before toolpath a
    for a in range(n):
        for i in range(under.start[a], under.start[a + 1]):
            c = under.of[i]
            implied[c] = a  # c itself is an edge already
            _mark(hindered, c, implied, a)
            for j in range(under.start[c], under.start[c + 1]):
                implied[under.of[j]] = a
                _mark(hindered, under.of[j], implied, a)
                _mark(under, under.of[j], implied, a)
        before[a] = a
        _mark(hindered, a, before, a)
        for i in range(hindered.start[a], hindered.start[a + 1]):
            b = hindered.of[i]
            keep[i] = implied[b] != a and not _holds(over, b, before, a)
    return keep


@inner_kernel
def _mark(lists: Lists, s: int, marks: NDArray[np.int32], mark: int) -> None:
    for k in range(lists.start[s], lists.start[s + 1]):
        marks[lists.of[k]] = mark


@inner_kernel
def _holds(over: Lists, b: int, marks: NDArray[np.int32], mark: int) -> bool:
    """Whether a toolpath one or two steps above b is marked."""
    for k in range(over.start[b], over.start[b + 1]):
        c = over.of[k]
        if marks[c] == mark:
            return True
        for j in range(over.start[c], over.start[c + 1]):
            if marks[over.of[j]] == mark:
                return True
    return False
