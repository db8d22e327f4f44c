"""The cheapest walk through one pair of columns, step by step: how its cost grows with each price."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.streamed_columns import Layout, arc_cost, way_cost
from slicer.sequence.bound.streamed_dp import Values
from slicer.sequence.bound.streamed_states import PairStates
from slicer.sequence.states import NONE


@kernel
def add_pair_subgradient(
    layout: Layout,
    price: NDArray[np.float64],
    c: int,
    states: PairStates,
    values: Values,
    walk: tuple[int, int, int, int],
    subgradient: NDArray[np.float64],
) -> None:
    """Follow the cheapest walk from a state on; add to ``subgradient`` (4, 2n) how it grows with the prices.

    Args:
        layout, price, c, states, values: as ``evaluate_pair`` was given and has filled them.
        walk: (i, j, u, side), where it begins: down-sets i and j of columns c and c + 1, counted from their
            first; the oriented toolpath that the nozzle is at the end of, or ``NONE``: it is outside; and
            then 0 left of the pair, 1 right of it.
        subgradient: changed in place.
    """
    i, j, u, side = walk
    a0, b0, end = layout.set_start[c], layout.set_start[c + 1], layout.set_start[c + 2]
    middle = 2 * layout.begin[c + 1]
    while i < b0 - a0 - 1 or j < end - b0 - 1:
        best, gone, step, step_set, way = np.inf, NONE, NONE, NONE, NONE
        if u != NONE:
            # Going outside and coming back is two steps of the walk, at the same state.
            for to in range(2):
                cost = values.outside[states.outside[i] + 2 * j + to] + way_cost(
                    layout, price, c, LEAVE_LEFT + to, u
                )
                if cost < best:
                    best, gone = cost, to
        for s, first in ((a0 + i, a0), (b0 + j, b0)):
            for e in range(layout.step_start[s], layout.step_start[s + 1]):
                to = layout.step_to[e] - first
                if first == a0 and not states.low[to] <= j < states.high[to]:
                    continue
                if first == b0 and to >= states.high[i]:
                    continue
                for f in range(2):
                    v = 2 * layout.step_path[e] + f
                    if first == a0:
                        width = states.high[to] - states.low[to]
                        at = states.left[to] + (2 * layout.step_slot[e] + f) * width + j
                        rest = values.left[at]
                    else:
                        top = layout.top_start[layout.step_to[e]] - layout.top_start[b0] + layout.step_slot[e]
                        rest = values.right[states.right[i] + 2 * top + f]
                    if u != NONE:
                        cost = arc_cost(layout, price, c, u, v) + rest
                        if cost < best:
                            best, step, step_set, gone = cost, v, to, NONE
                        continue
                    for entry in range(2):
                        cost = way_cost(layout, price, c, ENTER_LEFT + entry, v) + rest
                        if entry != side:
                            cost += layout.seam[c + 1] - layout.seam[c]
                        if cost < best:
                            best, step, step_set, way = cost, v, to, ENTER_LEFT + entry
        if best == np.inf:
            return  # it leaves the states that are looked at
        if gone != NONE:
            _use(layout, c, LEAVE_LEFT + gone, u, subgradient)
            u, side = NONE, gone
            continue
        if u == NONE:
            _use(layout, c, way, step, subgradient)
        elif (u < middle) != (step < middle):
            rightward = u < middle
            subgradient[LEAVE_RIGHT if rightward else LEAVE_LEFT, u] -= 1.0
            subgradient[ENTER_LEFT if rightward else ENTER_RIGHT, step] -= 1.0
        u = step
        if step < middle:
            i = step_set
        else:
            j = step_set
    if u != NONE:
        best, gone = 0.0, NONE
        for to in range(2):
            cost = way_cost(layout, price, c, LEAVE_LEFT + to, u)
            if cost < best:
                best, gone = cost, to
        if gone != NONE:
            _use(layout, c, LEAVE_LEFT + gone, u, subgradient)


@inner_kernel
def _use(layout: Layout, c: int, way: int, u: int, subgradient: NDArray[np.float64]) -> None:
    leftward = way in (LEAVE_LEFT, ENTER_LEFT)
    subgradient[way, u] += 1.0 if (u < 2 * layout.begin[c + 1]) == leftward else -1.0
