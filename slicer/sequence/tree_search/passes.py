"""Passes of tree search over a sequence: a tree behind every few toolpaths, see ``mcts``."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.local_search import Tour, tour_of
from slicer.sequence.problem import Draws, Search
from slicer.sequence.tree_search.rollouts import STRETCH_LENGTH, search_stretches

STRIDE = 10
"""How many toolpaths are committed to before the next tree."""
TREES = 10
"""How many trees pass between two looks at the clock."""
REPORT_EVERY = 20
"""So many looks at the clock pass between two reports within a pass."""


def tree_count(work: Tour) -> int:
    """How many trees a pass over a tour takes."""
    return max(1, -(-(int(work.order.shape[1]) - 1 - work.fixed) // STRIDE))


def search_pass(search: Search, work: Tour, state: NDArray[np.uint64], rollouts: int) -> bool:
    """One pass over a tour, in place; False where time ran out.

    Args:
        search: is offered what is found; counts the toolpaths put in order, and the states created.
        work: a tour, which becomes no dearer.
        state: uint64 (1,), for ``draw``.
        rollouts: how many each tree gets.
    """
    n = work.order.shape[1] - 2
    roots = range(work.fixed, n + 1, STRIDE)
    looks = range(0, len(roots), TREES)
    try:
        for look, k in enumerate(looks):
            some = roots[k : k + TREES]
            states = search_stretches(work, state, some[0], some[-1] + 1, STRIDE, rollouts)
            search.nodes_visited += sum(min(STRETCH_LENGTH, n + 1 - root) for root in some) * rollouts
            search.states_created += states
            if search.should_stop():
                return False
            if (look + 1) % REPORT_EVERY == 0 or look == len(looks) - 1:
                search.offer(work.oriented)
                search.report("tree search")
        return True
    finally:  # Ctrl-C comes between two kernels
        search.offer(work.oriented)


def improve_by_trees(
    search: Search, oriented: NDArray[np.int32], *, rollouts: int, stream: int
) -> NDArray[np.int32]:
    """One pass from a sequence (n,) on; what it finds is offered to the search.

    What comes back costs no more by direct travels. ``stream`` tells apart the random numbers of several
    calls with one seed.
    """
    work = tour_of(search, oriented)
    search_pass(search, work, search.random_state(Draws.TREES, stream), rollouts)
    return work.oriented
