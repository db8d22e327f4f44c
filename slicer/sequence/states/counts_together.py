"""Which counts of neighbouring columns go together, where a nozzle's body ties columns.

Counts do not say which toolpaths are printed (``group_counts``), but of some they do: where so many of a
group are printed that one of them can only be missing with too many that come after it, it is surely there;
and so what is surely not. All that must come before the former is printed of the other column as well, and
nothing that must come after the latter. Where the counts of that column leave no room for it, the two do not
go together: of those of ihc_8x8 under a needle of 25G, a single group a column, a sixth does.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.group_counts import Relaxation
from slicer.sequence.states.joint_states import members
from slicer.sequence.states.section import Section


class Counted(NamedTuple):
    """The states of one column, and what they say of its toolpaths.

    Attributes:
        group: int64 (n,), the group of each toolpath; of down-sets, each is its own.
        size: int64 (g,), the toolpaths of each group.
        printed: int64 (d, g), how many of each group are printed.
        surely: bool (d, n), which toolpaths are printed whatever the counts leave open.
        never: bool (d, n), which are not.
    """

    group: NDArray[np.int64]
    size: NDArray[np.int64]
    printed: NDArray[np.int64]
    surely: NDArray[np.bool_]
    never: NDArray[np.bool_]


def counts_together(
    section: Section, before: NDArray[np.bool_], states: list[Relaxation]
) -> list[NDArray[np.bool_]] | None:
    """For each two neighbouring columns, bool of the numbers of their states: which may go together.

    Args:
        section: what is ordered.
        before: bool (n, n), what must come before what, by ``comes_before``.
        states: of each of its columns.

    Returns:
        None where all do: no column is tied, or there is but one.
    """
    if section.columns < 2 or len(section.ties) == 0:
        return None
    own = [np.flatnonzero(section.column == c) for c in range(section.columns)]
    columns = [_counted(before[np.ix_(of, of)], some) for of, some in zip(own, states, strict=True)]
    out = []
    for a, b in pairwise(range(section.columns)):
        ahead, behind = before[np.ix_(own[a], own[b])], before[np.ix_(own[b], own[a])]
        out.append(
            _leave_room(columns[a], columns[b], ahead, behind)
            & _leave_room(columns[b], columns[a], behind, ahead).T
        )
    return out


def _counted(before: NDArray[np.bool_], states: Relaxation) -> Counted:
    n = len(before)
    if states.groups is None or states.printed is None:
        group, printed = np.arange(n), members(states.sets).astype(np.int64)
    else:
        group, printed = states.groups, states.printed
    size = np.bincount(group)
    from_on, up_to = before | np.eye(n, dtype=np.bool_), before.T | np.eye(n, dtype=np.bool_)
    surely, never = np.zeros((2, len(printed), n), np.bool_)
    for g in range(len(size)):
        in_group = group == g
        surely |= from_on[:, in_group].sum(axis=1) > (size[g] - printed[:, g])[:, None]
        never |= up_to[:, in_group].sum(axis=1) > printed[:, g][:, None]
    return Counted(group, size, printed, surely, never)


def _leave_room(
    of: Counted, other: Counted, ahead: NDArray[np.bool_], behind: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """bool (d, e), which counts of a column have room for what those of another one surely need of it.

    Args:
        ahead: bool (n, m), its toolpaths that must come before those of the other one.
        behind: bool (m, n), those of the other one that must come before its own.
    """
    needed = (other.surely.astype(np.float32) @ ahead.T.astype(np.float32)) > 0.5
    barred = (other.never.astype(np.float32) @ behind.astype(np.float32)) > 0.5
    out = np.ones((len(of.printed), len(other.printed)), np.bool_)
    for g in range(len(of.size)):
        in_group, printed = of.group == g, of.printed[:, g][:, None]
        out &= printed >= needed[:, in_group].sum(axis=1)
        out &= printed <= of.size[g] - barred[:, in_group].sum(axis=1)
    return out
