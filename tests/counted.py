"""States that are relaxed no more than so many travels demand, for tests of bounds over counts."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states import DownSets, RelaxedColumns, Section, few_down_sets


def relaxed_sets(section: Section, most_arcs: int) -> DownSets:
    """All down-sets, or the finest counts that make so few travels, if there are any."""
    return relaxed(section, most_arcs)[0]


def relaxed(section: Section, most_arcs: int) -> tuple[DownSets, list[NDArray[np.bool_]] | None]:
    """The same, and which of them may go together, where that has to be told."""
    whole = few_down_sets(section, most_arcs)
    if whole is not None:  # nothing is finer
        return whole, None
    columns = RelaxedColumns.of(section)
    chosen = columns.finest(most_arcs)
    sets = columns.sets(chosen)
    assert sets is not None
    return sets, columns.together(chosen)
