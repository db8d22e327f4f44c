"""The down-sets of each column: what can be printed of it at a moment, and what can come next.

A down-set holds, with every toolpath, all that must come before it in its column. What is printed of a sheet
is one down-set of each column; where a nozzle's body ties columns, not all of these go together, see
``joint_states``. The toolpath of a column that was printed last is a maximal element of its down-set: nothing
that must come after it is printed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.problem import scrambled
from slicer.sequence.states.section import NONE, Section

UNLIMITED = int(np.iinfo(np.int32).max)
WIDEST_CORRIDOR = 8
LEAST_ROOM = 4_096
"""Room for so many down-sets at first."""
MOST_STEPS = 32
"""Steps from a down-set, on average; a column with more counts as one with too many down-sets."""


class DownSets(NamedTuple):
    """The down-sets of all columns, numbered through; a smaller down-set has a smaller number.

    Attributes:
        start: int32 (c + 1,); column c has the down-sets start[c] (empty) .. start[c + 1] - 1 (all).
        step_start: int32 (d + 1,), the steps from down-set i are step_start[i] .. step_start[i + 1] - 1.
        step_path, step_to, step_slot: int32, the toolpath that a step prints, the down-set it leads to,
            and its place among the maximal elements of that one.
        top_start, top_path: int32, the maximal elements of each down-set, in the same form.
        local: int32 (n,), the number of each toolpath in its column.
        size: int32 (c,), the number of toolpaths in each column.
        corridor: int32 (c,); ``UNLIMITED`` where all down-sets are there. Otherwise only those that
            differ from a prefix of the guiding order by at most so many toolpaths.
    """

    start: NDArray[np.int32]
    step_start: NDArray[np.int32]
    step_path: NDArray[np.int32]
    step_to: NDArray[np.int32]
    step_slot: NDArray[np.int32]
    top_start: NDArray[np.int32]
    top_path: NDArray[np.int32]
    local: NDArray[np.int32]
    size: NDArray[np.int32]
    corridor: NDArray[np.int32]

    @property
    def complete(self) -> bool:
        """Whether no down-set was left out, so that bounds hold and searches can prove."""
        return bool((self.corridor == UNLIMITED).all())

    @property
    def counts(self) -> NDArray[np.int64]:
        """int64 (c,), the number of down-sets of each column."""
        return np.diff(self.start).astype(np.int64)


def down_sets(section: Section, limit: int, guide: NDArray[np.int32] | None = None) -> DownSets:
    """Enumerate the down-sets of each column.

    Down-sets of the first toolpath's column that lack it, and those that hold a fixed last toolpath
    without all others of its column, are left out. A column with more than ``limit`` of them is thinned
    to a corridor around a guiding order (Sniedovich and Voß, "The corridor method: a dynamic programming
    inspired metaheuristic", Control and Cybernetics 35, 2006): the widest of a few that fits. The guiding
    order itself always stays possible.

    Args:
        section: what is to be ordered.
        limit: the most down-sets of one column, before its corridor narrows.
        guide: int32 (n,), a printable order of toolpaths that begins and ends as the section must; None
            for any such order.
    """
    sets = _down_sets(section, limit, guide, (UNLIMITED, *range(WIDEST_CORRIDOR, -1, -1)))
    assert sets is not None  # a corridor of width 0 fits whatever the limit is
    return sets


def all_down_sets(section: Section, limit: int) -> DownSets | None:
    """All down-sets of each column, or None where one column has more than ``limit``."""
    if section.n and np.bincount(section.column).max() >= limit:  # a chain has one more than toolpaths
        return None
    return _down_sets(section, limit, None, (UNLIMITED,))


def count_down_sets(section: Section, limit: int) -> int | None:
    """How many down-sets a section of one column has, or None where there are more than ``limit``."""
    local = np.arange(section.n, dtype=np.int32)
    member, _, _ = _column(section, section.within_columns, local, local, UNLIMITED, limit)
    return len(member) or None


def _down_sets(
    section: Section, limit: int, guide: NDArray[np.int32] | None, widths: tuple[int, ...]
) -> DownSets | None:
    """The down-sets of each column in the first of these corridors that fits, if there is one."""
    n, columns = section.n, section.columns
    rank = np.empty(n, np.int32)
    rank[any_order(section) if guide is None else guide] = np.arange(n, dtype=np.int32)
    by_column = np.lexsort((rank, section.column)).astype(np.int32)
    begin = np.searchsorted(section.column[by_column], np.arange(columns + 1))
    local = np.empty(n, np.int32)
    local[by_column] = np.arange(n) - begin[section.column[by_column]]
    sets, moves, tops = [0], 0, 0
    parts: list[tuple[NDArray[np.int32], ...]] = []
    corridor = np.full(columns, UNLIMITED, np.int32)
    relation = section.within_columns
    for c in range(columns):
        paths = by_column[begin[c] : begin[c + 1]]
        for width in widths:
            member, step_start, step = _column(section, relation, paths, local, width, limit)
            if len(member):
                corridor[c] = width
                break
        else:
            return None
        top_start, top_path, slot = _tops(relation, paths, local, member, step)
        parts.append(
            (step_start[:-1] + moves, step[0], step[1] + sets[-1], slot, top_start[:-1] + tops, top_path)
        )
        moves, tops = moves + step.shape[1], tops + len(top_path)
        sets.append(sets[-1] + len(member))
    empty = np.empty(0, np.int32)
    joined = [np.concatenate([part[k] for part in parts] or [empty]).astype(np.int32) for k in range(6)]
    return DownSets(
        np.array(sets, np.int32),
        np.append(joined[0], np.int32(moves)),
        joined[1],
        joined[2],
        joined[3],
        np.append(joined[4], np.int32(tops)),
        joined[5],
        local,
        np.diff(begin).astype(np.int32),
        corridor,
    )


def any_order(section: Section) -> NDArray[np.int32]:
    """int32 (n,), some printable order of toolpaths that begins and ends where the section must."""
    first = section.first
    last = section.last >> 1 if section.last != NONE else NONE
    missing = np.diff(section.pred_start)
    ready = [int(s) for s in np.flatnonzero(missing == 0)[::-1] if s not in (first, last)]
    if first != NONE:
        ready.append(first)
    order: list[int] = []
    while ready:
        s = ready.pop()
        order.append(s)
        for t in section.succ[section.succ_start[s] : section.succ_start[s + 1]]:
            missing[t] -= 1
            if missing[t] == 0 and t != last:
                ready.append(int(t))
    if last not in (NONE, first):
        order.append(last)
    return np.array(order, np.int32)


Relation = tuple[NDArray[np.int32], NDArray[np.int32]]
"""``pred_start`` and ``pred``, see ``Section.within_columns``."""


def _column(
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


def _tops(
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
