"""What a search begins with where it was given no sequence."""

from slicer.sequence.construct.hill_climbing import hill_climbs
from slicer.sequence.construct.levels import level_start
from slicer.sequence.problem import Search


def start_greedily(search: Search) -> None:
    """Offer the best of greedy's sequences to a search that has none."""
    if not search.started:
        search.offer(min(hill_climbs(search), key=lambda run: run.travel_mm).oriented)


def start_along_levels(search: Search) -> None:
    """Offer greedy's sequence along levels to a search that has none."""
    if not search.started:
        search.offer(level_start(search.problem, search.objective, search.near(), search.should_stop))
