"""Which counts of neighbouring columns go together, where a nozzle's body ties columns.

Counts do not say which toolpaths are printed (``group_counts``), but of some they do: where so many of a
group are printed that one of them can only be missing with too many that come after it, it is surely there;
and so what is surely not. All that must come before the former is printed of the other column as well, and
nothing that must come after the latter. Where the counts of that column leave no room for it, the two do not
go together: of those of ihc_8x8 under a needle of 25G, a single group a column, a sixth does.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.corridor import MOST_DENSE
from slicer.sequence.states.group_counts import Relaxation
from slicer.sequence.states.joint_states import members

MOST_WORK = 1e9
"""Comparisons, at 2 to 3 ns each: what takes longer is not told."""
MULTIPLIED = 40
"""So many toolpaths of down-sets are looked at, in products of matrices, while one count is compared."""


class Counted(NamedTuple):
    """The states of one column, and what they say of its toolpaths.

    Attributes:
        group: int64 (n,), the group of each toolpath; None where they are down-sets.
        printed: int64 (d, g), how many of each group are printed; of down-sets bool (d, n), which toolpaths.
        surely: bool (d, n), which toolpaths are printed whatever the counts leave open.
        never: bool (d, n), which are not.
    """

    group: NDArray[np.int64] | None
    printed: NDArray[Any]
    surely: NDArray[np.bool_]
    never: NDArray[np.bool_]


def counts_together(
    column: NDArray[np.int32],
    before: NDArray[np.bool_],
    states: list[Relaxation],
    should_stop: Callable[[], bool] = lambda: False,
) -> list[NDArray[np.bool_]] | None:
    """For each two neighbouring columns, bool of the numbers of their states: which may go together.

    Args:
        column: int32 (n,), the column of each toolpath.
        before: bool (n, n), what must come before what, by ``comes_before``.
        states: of each column.
        should_stop: asked between columns.

    Returns:
        None where it takes too long to tell, or too much room, or the time is over: then any may.
    """
    if _takes_too_long(states):
        return None
    own = [np.flatnonzero(column == c) for c in range(len(states))]
    told: list[Counted] = []
    out = []
    for c, some in enumerate(states):
        if should_stop():
            return None
        told.append(_counted(before[np.ix_(own[c], own[c])], some))
        if c > 0:
            ahead, behind = before[np.ix_(own[c - 1], own[c])], before[np.ix_(own[c], own[c - 1])]
            out.append(
                _leave_room(told[c - 1], told[c], ahead, behind)
                & _leave_room(told[c], told[c - 1], behind, ahead).T
            )
    return out


def _takes_too_long(states: list[Relaxation]) -> bool:
    """Whether there are too many pairs of states to be tabulated, or to be compared."""
    pairs = work = 0.0
    for some, other in pairwise(states):
        table = float(some.sets.counts[0]) * float(other.sets.counts[0])
        pairs += table
        work += table * (_looks(some) + _looks(other))
    return pairs > MOST_DENSE or work > MOST_WORK


def _looks(states: Relaxation) -> float:
    """How many counts are compared for each pair of states, or what takes as long."""
    if states.groups is None:
        return float(states.sets.size[0]) / MULTIPLIED
    return float(states.groups.max() + 1)


def _counted(before: NDArray[np.bool_], states: Relaxation) -> Counted:
    n = len(before)
    from_on, up_to = before | np.eye(n, dtype=np.bool_), before.T | np.eye(n, dtype=np.bool_)
    if states.groups is None or states.printed is None:
        printed = members(states.sets)
        return Counted(None, printed, _any(printed, from_on), _any(~printed, up_to))
    groups, counts = states.groups, states.printed
    size = np.bincount(groups)
    surely, never = np.zeros((2, len(counts), n), np.bool_)
    for g in range(len(size)):
        in_group = groups == g
        surely |= from_on[:, in_group].sum(axis=1) > (size[g] - counts[:, g])[:, None]
        never |= up_to[:, in_group].sum(axis=1) > counts[:, g][:, None]
    return Counted(groups, counts, surely, never)


def _leave_room(
    of: Counted, other: Counted, ahead: NDArray[np.bool_], behind: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """bool (d, e), which states of a column have room for what those of another one surely need of it.

    Args:
        ahead: bool (n, m), its toolpaths that must come before those of the other one.
        behind: bool (m, n), those of the other one that must come before its own.
    """
    needed, barred = _any(other.surely, ahead), _any(other.never, behind.T)
    if of.group is None:
        return ~(_any(~of.printed, needed) | _any(of.printed, barred))
    size = np.bincount(of.group)
    out = np.ones((len(of.printed), len(other.printed)), np.bool_)
    for g in range(len(size)):
        in_group, printed = of.group == g, of.printed[:, g][:, None]
        out &= printed >= needed[:, in_group].sum(axis=1)
        out &= printed <= size[g] - barred[:, in_group].sum(axis=1)
    return out


def _any(rows: NDArray[np.bool_], of: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """bool (a, b), whether a row (a, n) and one of (b, n) share a toolpath."""
    found: NDArray[np.bool_] = (rows.astype(np.float32) @ of.astype(np.float32).T) > 0.5
    return found
