"""Columns that a nozzle's body ties closely are taken as one.

Where toolpaths on both sides of a border have to keep about the same height, hardly any pair of down-sets
goes together: of 8930 pairs of the first two columns of muscle_us_8x8 there are 345 left under a tip that
reaches one spacing to either side. The two together are then one column with few down-sets, and bounds over
pairs of such columns see what four columns do.
"""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem import Objective, Problem
from slicer.sequence.states.corridor import MOST_ARCS, Corridor, complete_corridor, widest_corridor
from slicer.sequence.states.downsets import count_down_sets
from slicer.sequence.states.section import Section

MOST_DOWN_SETS = 500
"""Columns are joined while there are no more of the whole."""
WIDEST_FIRST = (16_000, 8_000, 4_000, 2_000, 1_000, MOST_DOWN_SETS)
"""The same where few wide columns may be held: the wider, the tighter the bound.

Of dti_small_101D_sagittal_10x10, cut for a tip that reaches one spacing to either side, it comes to 338 mm
with 16000, to 335 with 8000, and to 333, 312, 294 and 284 mm with the others, under a sequence of 355.
"""
MOST_TOOLPATHS = 1_200_000
"""A joined column has no more toolpaths than this over the number of all: travels inside it are tabulated."""

Counts = dict[tuple[int, int], int | None]
"""How many down-sets columns begin .. end have together; None where they are too many for a first limit."""

WHOLE = 2
"""A block holds so many columns, whatever their states."""
MOST_ARCS_OF_WHOLE = 500_000_000
"""Travels between the states of two joined columns that hold the whole sheet: nothing is relaxed there, and
so they are looked at a few times. Such a search takes up to 1.4 GB.
"""

_JOINED: WeakKeyDictionary[Problem, dict[tuple[int, int], tuple[NDArray[np.int32], Corridor]]] = (
    WeakKeyDictionary()
)
"""The complete corridors of problems with tied columns, by the most travels: one job asks several times."""


def join_tied_columns(section: Section, most_down_sets: int = MOST_DOWN_SETS) -> Section:
    """Join neighbouring columns, from left to right, while they are tied and have few down-sets together.

    Joined columns do not overlap in x either; nothing else of a section changes. Without ties, it is given
    back as it is.
    """
    ties = section.ties
    if len(ties) == 0:
        return section
    return _joined(section, _groups(section, ties, most_down_sets, {}))


def states_of_all(
    problem: Problem,
    objective: Objective,
    guide: NDArray[np.int32],
    most_arcs: int,
    most_of_whole: int = 0,
) -> tuple[Section, Corridor | None]:
    """A whole problem with its tied columns joined as far as all states can still be held, and its corridor.

    See ``widest_corridor`` for the arguments.

    Args:
        most_of_whole: the most travels where no more than two joined columns are left, so that states know
            all that is printed, if that is more.
    """
    section = Section.whole(problem, objective)
    most = (min(most_arcs, MOST_ARCS), min(most_of_whole, MOST_ARCS_OF_WHOLE))
    known = _JOINED.get(problem, {}).get(most)
    if known is not None:
        groups, corridor = known
        return _joined(section, groups), corridor
    found = _complete_joined(section, *most)
    if isinstance(found, Section):
        return found, widest_corridor(found, guide, most_arcs)
    joined, complete = found
    groups = np.empty(section.columns, np.int32)
    groups[section.column] = joined.column
    _JOINED.setdefault(problem, {})[most] = groups, complete
    return found


def _complete_joined(
    section: Section, most_arcs: int, most_of_whole: int
) -> tuple[Section, Corridor] | Section:
    """The section with its tied columns joined as far as all states can be held, and these.

    Where no joining has so few, the section alone, joined as little as is tried.
    """
    ties = section.ties
    counts: Counts = {}
    joined = section
    for most_down_sets in WIDEST_FIRST if len(ties) else ():
        before = joined.column
        joined = _joined(section, _groups(section, ties, most_down_sets, counts))
        if np.array_equal(joined.column, before):
            continue
        whole = joined.columns <= WHOLE
        corridor = complete_corridor(joined, max(most_arcs, most_of_whole) if whole else most_arcs)
        if corridor is not None:
            return joined, corridor
    return joined


def _joined(section: Section, groups: NDArray[np.int32]) -> Section:
    """A section with other columns: int32 (c,), the number of that which each goes into."""
    first = np.flatnonzero(np.diff(groups, prepend=-1))
    extent = np.stack(
        [np.minimum.reduceat(section.extent[:, 0], first), np.maximum.reduceat(section.extent[:, 1], first)],
        axis=1,
    )
    return replace(section, column=groups[section.column], extent=extent)


def _groups(
    section: Section, ties: NDArray[np.int32], most_down_sets: int, counts: Counts
) -> NDArray[np.int32]:
    """int32 (c,), the number of the joined column that each column goes into.

    ``counts`` of larger limits are taken, and further ones entered.
    """
    joined = np.sort(section.column[ties], axis=1)
    groups = np.zeros(section.columns, np.int32)
    size = np.bincount(section.column, minlength=section.columns)
    begin = 0
    for c in range(1, section.columns):
        tied = ((joined[:, 0] >= begin) & (joined[:, 1] == c)).any()
        small = size[begin : c + 1].sum() * section.n <= MOST_TOOLPATHS
        if tied and small and (begin, c) not in counts:
            inside = (section.column >= begin) & (section.column <= c)
            counts[begin, c] = count_down_sets(section.part(inside), most_down_sets)
        together = counts.get((begin, c))
        if not (tied and small and together is not None and together <= most_down_sets):
            begin = c
        groups[c] = groups[c - 1] + (begin == c)
    return groups
