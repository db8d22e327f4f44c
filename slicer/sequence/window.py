"""Window search: order a few consecutive toolpaths of a sequence anew, exactly or nearly so, everywhere.

What a window holds is bounded by the two down-sets before and after it, so that its columns have few
down-sets of their own. Where the pair bound of a window reaches what the window costs, there is nothing to
gain; elsewhere a narrow layered search looks for less. Windows overlap by half, and grow when a pass over
the sequence finds nothing.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.blocks import cover
from slicer.sequence.descend import RELATIVE_EPS, descend
from slicer.sequence.downsets import down_sets
from slicer.sequence.horizon import Horizon
from slicer.sequence.ledger import ARCS_PER_NODE, Ledger
from slicer.sequence.method import Options
from slicer.sequence.overfly import walk_cost
from slicer.sequence.pair_bound import PairBound
from slicer.sequence.problem import Problem
from slicer.sequence.section import Section, extents

FIRST_LENGTH = 50
GROWTH = 1.4
STEPS = 15
"""Steps of the bound for each window."""
WIDTH = 100
"""Nodes of a layer in a window's search."""
MOST_DOWN_SETS = 300
"""A column of a window with more than these is searched in a corridor around the given order."""
MERGED_STATES = 2_000
WORK_PER_TOOLPATH = {"quick": 2_000, "default": 10_000, "high": 60_000}


def polish(
    problem: Problem,
    options: Options,
    oriented: NDArray[np.int32],
    *,
    work: int | None = None,
    length: int = FIRST_LENGTH,
    settled: set[bytes] | None = None,
) -> NDArray[np.int32]:
    """Improve a printable sequence by window search; what comes back costs no more.

    Args:
        problem: what is ordered.
        options: effort, objective, deadline and progress.
        oriented: int32 (n,), oriented toolpaths.
        work: the budget, as a ``Ledger`` counts it; None for that of the effort.
        length: toolpaths in a window, at first.
        settled: windows that hold nothing to gain; those found are added. None where none is known yet.

    Returns:
        int32 (n,), oriented toolpaths.
    """
    n = problem.n
    ledger = Ledger(WORK_PER_TOOLPATH[options.effort] * n if work is None else work)
    best = oriented.copy()
    extent = extents(problem)
    settled = set() if settled is None else settled
    while n > 1:
        length = min(length, n)
        gained = 0.0
        horizon, done = Horizon(problem.segments), 0
        for begin in _begins(n, length):
            if ledger.work >= ledger.budget or options.out_of_time():
                return best
            window = best[begin : begin + length]
            if window.tobytes() in settled:
                continue
            if options.objective.routed:
                horizon.print(best[done:begin])
                done = begin
            section = Section.window(
                problem, options.objective, best, begin, begin + length, horizon.pieces(), extent
            )
            gain = improve_window(section, window, options, ledger)
            gained += gain
            if gain == 0.0:
                settled.add(window.tobytes())
        if gained == 0.0:
            if length == n:
                break
            length = int(length * GROWTH) + 1
    return best


def _begins(n: int, length: int) -> list[int]:
    """Where the windows of a pass begin; the last one reaches the end."""
    stride = max(1, length // 2)
    return [*range(0, n - length, stride), n - length]


def improve_window(section: Section, inner: NDArray[np.int32], options: Options, ledger: Ledger) -> float:
    """Order a window anew, in place, and say by how much cheaper it has become.

    Args:
        section: the window as a section.
        inner: int32 (k,), the oriented toolpaths of the window.
        options: for the deadline.
        ledger: where the work is entered.
    """
    order = np.arange(section.n, dtype=np.int32)
    sets = down_sets(section, MOST_DOWN_SETS, order)
    bound = PairBound.over(section, sets, cover(sets, MERGED_STATES))
    cost = walk_cost(section, sets, bound.sky, 2 * order + (inner & 1))
    ledger.work += 500 + STEPS * bound.blocks.arcs // ARCS_PER_NODE
    bound.improve(cost, STEPS)
    if bound.bound >= cost * (1 - RELATIVE_EPS):
        return 0.0
    bound.settle()
    found = descend(bound, cost, WIDTH, options)
    ledger.add(found)
    if found.oriented is None or found.cost >= cost:
        return 0.0
    inner[:] = 2 * (inner[found.oriented >> 1] >> 1) + (found.oriented & 1)
    return cost - found.cost
