"""The down-sets of one column: which there are, where their steps lead, and their maximal elements."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.problem import scrambled
from slicer.sequence.states.section import NONE, Section

UNLIMITED = int(np.iinfo(np.int32).max)
LEAST_ROOM = 4_096
"""Room for so many down-sets at first."""
MOST_STEPS = 32
"""Steps from a down-set, on average; a column with more counts as one with too many down-sets."""

Relation = tuple[NDArray[np.int32], NDArray[np.int32]]
"""``pred_start`` and ``pred``, see ``Section.within_columns``."""


def column_down_sets(
    section: Section,
    relation: Relation,
    paths: NDArray[np.int32],
    local: NDArray[np.int32],
    width: int,
    limit: int,
) -> tuple[NDArray[np.bool_], NDArray[np.int32], NDArray[np.int32]]:
    """Down-sets of one column: members (d, size), where the steps of each start, and [path, to] (2, s).

    ``paths`` is in the order of the guide, so that a down-set of m toolpaths leaves the corridor by as
    many as it has members from place m on. No rows at all mean that there are more than ``limit``.
    """
    size = len(paths)
    first = last = NONE
    if section.first != NONE and section.column[section.first] == section.column[paths[0]]:
        first = int(local[section.first])
    if section.last != NONE and section.column[section.last >> 1] == section.column[paths[0]]:
        last = int(local[section.last >> 1])
    # A corridor of width 0 is one chain, and must fit whatever the limit is.
    most = max(limit, size + 1)
    capacity = min(most, max(2 * size + 2, LEAST_ROOM))
    while True:
        member = np.zeros((capacity, size), np.bool_)
        step_start = np.zeros(capacity + 1, np.int32)
        step = np.empty((2, min(size, MOST_STEPS) * capacity), np.int32)
        count = _enumerate(
            Column(paths, local, *relation, first, last, width),
            member,
            step_start,
            step,
            np.zeros(capacity, np.uint64),
            np.full(2 * capacity, NONE, np.int32),
        )
        if count != NONE:
            return member[:count], step_start[: count + 1], step[:, : step_start[count]]
        if capacity == most:
            return member[:0], step_start[:1], step[:, :0]
        capacity = min(most, 4 * capacity)


class Column(NamedTuple):
    """What the down-sets of one column depend on.

    Attributes:
        paths: int32 (k,), its toolpaths in the order of the guide.
        local: int32 (n,), the place of each toolpath among those of its column.
        pred_start, pred: the precedence within columns.
        first, last: the places of toolpaths that come first and last, or ``NONE``.
        width: how far from a prefix of the guide a down-set may be.
    """

    paths: NDArray[np.int32]
    local: NDArray[np.int32]
    pred_start: NDArray[np.int32]
    pred: NDArray[np.int32]
    first: int
    last: int
    width: int


@bare_kernel
def _enumerate(
    column: Column,
    member: NDArray[np.bool_],
    step_start: NDArray[np.int32],
    step: NDArray[np.int32],
    key: NDArray[np.uint64],
    table: NDArray[np.int32],
) -> int:
    """Fill in the down-sets of a column, breadth first; how many, or ``NONE`` where the room is too small."""
    paths, local, pred_start, pred, first, last, width = column
    size = len(paths)
    count, begin, moves = 1, 0, 0
    for m in range(size):
        end = count
        for i in range(begin, end):
            beyond = 0
            for t in range(m + 1, size):
                beyond += member[i, t]
            for t in range(size):
                s = paths[t]
                if member[i, t] or (t == last and m < size - 1) or (m == 0 and first >= 0 and t != first):
                    continue
                if beyond + (t > m) > width:
                    continue
                printable = True
                for e in range(pred_start[s], pred_start[s + 1]):
                    printable &= member[i, local[pred[e]]]
                if not printable:
                    continue
                hashed = key[i] ^ scrambled(t + 1)
                place = int(hashed >> np.uint64(32)) % len(table)
                # Down-sets of earlier layers may still be in the table: their places count as free.
                while table[place] >= end and not (
                    key[table[place]] == hashed and _adds(member, table[place], i, t)
                ):
                    place = (place + 1) % len(table)
                if table[place] < end:
                    if count == len(member):
                        return NONE
                    table[place] = count
                    key[count] = hashed
                    for q in range(size):
                        member[count, q] = member[i, q] or q == t
                    count += 1
                if moves == step.shape[1]:
                    return NONE
                step[0, moves], step[1, moves] = s, table[place]
                moves += 1
            step_start[i + 1] = moves
        begin = end
    step_start[count] = moves
    return count


@inner_kernel
def _adds(member: NDArray[np.bool_], to: int, base: int, path: int) -> bool:
    """Whether down-set ``to`` is down-set ``base`` with ``path`` added."""
    if not member[to, path]:
        return False
    differs = False
    for t in range(member.shape[1]):
        differs |= member[to, t] != member[base, t] and t != path
    return not differs


def maximal_elements(
    relation: Relation,
    paths: NDArray[np.int32],
    local: NDArray[np.int32],
    member: NDArray[np.bool_],
    step: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """The maximal elements of each down-set, and for each step the place of its toolpath among them."""
    top = member.copy()
    _uncover(paths, local, *relation, member, top)
    rank = np.cumsum(top, axis=1)
    top_start = np.concatenate([[0], np.cumsum(rank[:, -1])]).astype(np.int32)
    return top_start, paths[np.nonzero(top)[1]], (rank[step[1], local[step[0]]] - 1).astype(np.int32)


@bare_kernel
def _uncover(
    paths: NDArray[np.int32],
    local: NDArray[np.int32],
    pred_start: NDArray[np.int32],
    pred: NDArray[np.int32],
    member: NDArray[np.bool_],
    top: NDArray[np.bool_],
) -> None:
    """Clear ``top`` where another member of the down-set must come after."""
    for i in range(len(member)):
        for t in range(member.shape[1]):
            if member[i, t]:
                for e in range(pred_start[paths[t]], pred_start[paths[t] + 1]):
                    top[i, local[pred[e]]] = False
