"""The ascent of the streamed bound: quick steps among states near good ones, and a look at all in the end.

Columns of good sequences keep about the same pace, and so do the cheapest walks of the bound. Prices rise
there as they would over all states, for a tenth of the time and less; the bound that they give over all
states is the one that counts. Where it comes out lower, the ascent goes on in a wider corridor.
"""

import numpy as np

from slicer.sequence.bound.nearby import PACE
from slicer.sequence.bound.streamed_bound import EVERYTHING, StreamedBound
from slicer.sequence.bound.subgradient_ascent import step_lengths
from slicer.sequence.problem import Objective, Search
from slicer.sequence.states import DownSets, Section, all_down_sets, extent, join_tied_columns

MOST_DOWN_SETS = 6_000
"""A column with more has too many for a bound."""
MOST_VALUES = 60_000_000
"""Values of the states of two columns, at 8 bytes; more count as too many as well."""
ARCS = {"quick": 1_500_000_000, "default": 15_000_000_000, "high": 100_000_000_000}
"""Travels looked at in all steps, at about 1.5 ns each."""
MOST_STEPS = {"quick": 30, "default": 150, "high": 400}
LEAST_STEPS = 4
STRETCH = 4
"""One look at all states may see so many times as many travels."""
AGAIN_STEPS, AGAIN_GAP = 20, 0.005
"""How many, and as if how much were left, where the prices are good ones but for a few columns."""
TOLERANCE = 3e-3
"""The part of the cost by which all states may bring the bound down before the corridor is too narrow."""
MOST_ROUNDS = 3
TOO_MANY = "columns with too many down-sets for a bound"


def open_streamed_bound(search: Search) -> StreamedBound | None:
    """The bound of a search, not evaluated yet; None where there can be none, and then the progress says why.

    For straight travel alone: other objectives it does not price. None as well where time ran out.
    """
    if search.objective.routed or search.should_stop():
        return None
    found = _down_sets(search, search.objective)
    if isinstance(found, str):
        search.report(found)
        return None
    if search.should_stop():
        return None
    bound = StreamedBound(*found)
    if max(int(states.size.max()) for states in bound.states) > MOST_VALUES:
        search.report(TOO_MANY)
        return None
    return bound


def is_streamable(search: Search) -> bool:
    """Whether straight travel on a search's problem has a streamed bound, as far as the columns tell."""
    return not isinstance(_down_sets(search, Objective()), str)


def _down_sets(search: Search, objective: Objective) -> tuple[Section, DownSets] | str:
    """What is ordered and all down-sets of its columns, or why there is no such bound."""
    section = join_tied_columns(Section.whole(search.problem, objective))
    if section.columns < 2:
        return "a single column, no bound"
    sets = all_down_sets(section, MOST_DOWN_SETS)
    if sets is None:
        return TOO_MANY
    arcs = extent(sets, np.arange(section.columns, dtype=np.int32))[1]
    if arcs > STRETCH * ARCS[search.effort]:
        return "a sheet too large for a bound with this effort"
    return section, sets


def climb(search: Search, bound: StreamedBound, *, again: bool = False) -> bool:
    """Raise the bound as far as the effort allows, and tell the search; False where time ran out.

    It is left at its best prices, in the corridor. With ``again`` it begins near those and takes few steps.
    """
    most = AGAIN_STEPS if again else MOST_STEPS[search.effort]
    pace = PACE * bound.columns / search.problem.n
    for _ in range(MOST_ROUNDS):
        bound.look_at(pace)
        steps = int(np.clip(ARCS[search.effort] // bound.arcs, LEAST_STEPS, most))
        for share in step_lengths(steps, AGAIN_GAP if again else 1.0):
            far = (
                max(0.0, -bound.bound) if np.isfinite(bound.bound) else 0.0
            )  # from where it should be at least
            if not bound.step(share * (search.cost + far), search.should_stop):
                break
            search.report("prices")
        if search.should_stop():
            return False
        near = bound.bound
        bound.look_at(EVERYTHING)
        bound.price = bound.best
        everywhere = bound.evaluate(np.zeros_like(bound.price), search.should_stop)
        if everywhere is None:
            return False
        search.raise_bound_on_all(everywhere)
        search.report("bound")
        bound.look_at(pace)
        if -np.inf < near <= everywhere + TOLERANCE * search.cost or pace >= EVERYTHING:
            break
        pace *= 2
    return True


def raise_streamed_bound(search: Search) -> None:
    """Raise a search's bound on straight travel as far as the effort allows, see ``open_streamed_bound``."""
    bound = open_streamed_bound(search)
    if bound is not None and not search.proved:
        climb(search, bound)
