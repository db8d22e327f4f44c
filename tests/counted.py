"""States that are relaxed no more than so many travels demand, for tests of bounds over counts."""

from slicer.sequence.states import DownSets, RelaxedColumns, Section, few_down_sets


def relaxed_sets(section: Section, most_arcs: int) -> DownSets:
    """All down-sets, or the finest counts that make so few travels, if there are any."""
    whole = few_down_sets(section, most_arcs)
    if whole is not None:  # nothing is finer
        return whole
    columns = RelaxedColumns.of(section)
    sets = columns.sets(columns.finest(most_arcs))
    assert sets is not None
    return sets
