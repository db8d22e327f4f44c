"""How a method that works on a tour sets out, and how it brings one to a local optimum under the clock."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.construct import initial_incumbent, level_start
from slicer.sequence.local_search.block_exchange import Tour, new_tour
from slicer.sequence.local_search.descent import descend
from slicer.sequence.local_search.perturbation import REACH
from slicer.sequence.problem import Incumbent, Options, Problem, neighbours, random_state

SLICE = 5_000
"""Toolpaths that descent takes up between two looks at the clock."""


class Start(NamedTuple):
    """What a search begins with.

    Attributes:
        incumbent: the given sequence, or the one that stands for it.
        work: a tour that starts as the incumbent's.
        state: uint64 (1,), for ``draw``.
    """

    incumbent: Incumbent
    work: Tour
    state: NDArray[np.uint64]


def start_search(problem: Problem, options: Options, stream: int, *, along_levels: bool) -> Start:
    """Begin from ``options.initial``, or along levels, or from greedy's sequence.

    ``stream`` tells apart the draws of two methods with one seed.
    """
    near = neighbours(problem, options.objective)
    if options.initial is None and along_levels:
        start = level_start(problem, options.objective, near, options.out_of_time)
        options = options.starting_from(start)
    incumbent = initial_incumbent(problem, options)
    work = new_tour(problem, options.objective, near, incumbent.oriented)
    state = random_state(options.seed, stream)
    return Start(incumbent, work, state)


def reach_local_optimum(work: Tour, options: Options) -> bool:
    """Bring a tour to a local optimum; False where time ran out, with what has been gained by then."""
    n = work.order.shape[1] - 2
    queue, queued = np.empty(n, np.int32), np.zeros(n, np.bool_)
    span = np.array([n + 2, 0])
    spare = np.empty((max(work.longest, REACH), 3))
    for low in range(0, n, SLICE):
        if low and options.out_of_time():
            return False
        count = min(SLICE, n - low)
        queue[:count] = np.arange(low, low + count)
        queued[low : low + count] = True
        descend(work, queue, queued, count, span, spare)
    return True
