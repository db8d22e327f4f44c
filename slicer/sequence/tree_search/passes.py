"""Passes of tree search over a sequence: a tree behind every few toolpaths, see ``mcts``."""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.local_search import Tour, new_tour
from slicer.sequence.problem import Incumbent, Neighbours, Options, Problem, random_state
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


def search_pass(
    work: Tour,
    state: NDArray[np.uint64],
    options: Options,
    incumbent: Incumbent,
    rollouts: int,
    counts: list[int] | None = None,
) -> bool:
    """One pass over a tour, in place; False where time ran out.

    Args:
        work: a tour, which becomes no dearer.
        state: uint64 (1,), for ``draw``.
        options: for the deadline.
        incumbent: is offered what is found, and told.
        rollouts: how many each tree gets.
        counts: two numbers that are added to: toolpaths put in order, and states created.
    """
    n = work.order.shape[1] - 2
    roots = range(work.fixed, n + 1, STRIDE)
    looks = range(0, len(roots), TREES)
    try:
        for look, k in enumerate(looks):
            some = roots[k : k + TREES]
            states = search_stretches(work, state, some[0], some[-1] + 1, STRIDE, rollouts)
            if counts is not None:
                counts[0] += sum(min(STRETCH_LENGTH, n + 1 - root) for root in some) * rollouts
                counts[1] += states
            if options.out_of_time():
                return False
            if (look + 1) % REPORT_EVERY == 0 or look == len(looks) - 1:
                incumbent.offer(work.oriented)
                incumbent.report("tree search", bounded=False)
        return True
    finally:  # Ctrl-C comes between two kernels
        incumbent.offer(work.oriented)


def improve_by_trees(
    problem: Problem,
    options: Options,
    near: Neighbours,
    incumbent: Incumbent,
    oriented: NDArray[np.int32],
    *,
    rollouts: int,
    stream: int,
) -> NDArray[np.int32]:
    """One pass from a sequence (n,) on, which is offered to the incumbent.

    What comes back costs no more by direct travels. ``stream`` tells apart the random numbers of several
    calls with one seed.
    """
    work = new_tour(problem, options.objective, near, oriented)
    state = random_state(options.seed, 2, stream)
    search_pass(work, state, options, incumbent, rollouts)
    return work.oriented
