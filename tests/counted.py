"""States that are relaxed no more than so many travels demand, for tests of bounds over counts."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states import DownSets, RelaxedColumns, Section, few_down_sets


def relaxed_sets(section: Section, most_arcs: int) -> DownSets:
    """All down-sets, or the finest counts that make so few travels, if there are any."""
    return relaxed(section, most_arcs)[0]


def relaxed(
    section: Section, most_arcs: int
) -> tuple[DownSets, list[NDArray[np.bool_]] | None, NDArray[np.bool_] | None]:
    """The same, and where it has to be told, which of them may go together, and what never follows."""
    whole = few_down_sets(section, most_arcs)
    if whole is not None:  # nothing is finer
        return whole, None, None
    columns = RelaxedColumns.of(section)
    chosen = columns.finest(most_arcs)
    sets = columns.sets(chosen)
    assert sets is not None
    return sets, columns.together(chosen), columns.never


def walks_through(sets: DownSets, order: list[int], column: int) -> bool:
    """Whether a column's toolpaths, in this order, are steps from its first state to its last, and may follow."""
    at, last = sets.start[column], None
    for s in order:
        steps = range(sets.step_start[at], sets.step_start[at + 1])
        taken = [e for e in steps if sets.step_path[e] == s]
        if len(taken) != 1:
            return False
        if last is not None and len(sets.follows):
            may = sets.follows[sets.follow_start[last] : sets.follow_start[last + 1]]
            if taken[0] - sets.step_start[at] not in may:
                return False
        at = sets.step_to[taken[0]]
        last = sets.top_start[at] + sets.step_slot[taken[0]]
        if sets.top_path[last] != s:
            return False
    return at == sets.start[column + 1] - 1
