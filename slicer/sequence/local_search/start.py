"""A tour for a search, and how it is brought to a local optimum under the clock."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.local_search.block_exchange import Tour, new_tour
from slicer.sequence.local_search.descent import descend
from slicer.sequence.local_search.perturbation import REACH
from slicer.sequence.problem import Search

SLICE = 5_000
"""Toolpaths that descent takes up between two looks at the clock."""


def tour_of(search: Search, oriented: NDArray[np.int32]) -> Tour:
    """A tour that starts as a sequence (n,) of oriented toolpaths."""
    return new_tour(search.problem, search.objective, search.near(), oriented)


def reach_local_optimum(search: Search, work: Tour) -> bool:
    """Bring a tour to a local optimum; False where time ran out, with what has been gained by then."""
    n = work.order.shape[1] - 2
    queue, queued = np.empty(n, np.int32), np.zeros(n, np.bool_)
    span = np.array([n + 2, 0])
    spare = np.empty((max(work.longest, REACH), 3))
    for low in range(0, n, SLICE):
        if low and search.should_stop():
            return False
        count = min(SLICE, n - low)
        queue[:count] = np.arange(low, low + count)
        queued[low : low + count] = True
        descend(work, queue, queued, count, span, spare)
    return True
