"""The down-sets of each column: what can be printed of it at a moment, and what can come next.

A down-set holds, with every toolpath, all that must come before it in its column. What is printed of a sheet
is one down-set of each column; where a nozzle's body ties columns, not all of these go together, see
``joint_states``. The toolpath of a column that was printed last is a maximal element of its down-set: nothing
that must come after it is printed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.one_column import UNLIMITED, column_down_sets, maximal_elements
from slicer.sequence.states.section import NONE, Section

WIDEST_CORRIDOR = 8
NOTHING_MORE = (np.zeros(1, np.int32), np.empty(0, np.int32))
"""``DownSets.follow_start`` and ``follows`` where every step may come next."""


class DownSets(NamedTuple):
    """The down-sets of all columns, numbered through; a smaller down-set has a smaller number.

    Attributes:
        start: int32 (c + 1,); column c has the down-sets start[c] (empty) .. start[c + 1] - 1 (all).
        step_start: int32 (d + 1,), the steps from down-set i are step_start[i] .. step_start[i + 1] - 1.
        step_path, step_to, step_slot: int32, the toolpath that a step prints, the down-set it leads to,
            and its place among the maximal elements of that one.
        top_start, top_path: int32, the maximal elements of each down-set, in the same form.
        follow_start, follows: int32, for each maximal element the steps of its down-set, counted there, that
            can come next of the column where it was the last one; empty where these are all steps anyway.
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
    follow_start: NDArray[np.int32]
    follows: NDArray[np.int32]
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
    member, _, _ = column_down_sets(section, section.within_columns, local, local, UNLIMITED, limit)
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
            member, step_start, step = column_down_sets(section, relation, paths, local, width, limit)
            if len(member):
                corridor[c] = width
                break
        else:
            return None
        top_start, top_path, slot = maximal_elements(relation, paths, local, member, step)
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
        *NOTHING_MORE,
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
