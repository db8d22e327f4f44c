"""The cheapest walk through one pair of neighbouring columns, without a graph of its states.

The same dynamic programme as ``pair_dp``, for sheets whose blocks together do not fit into memory. Nothing
but the values of the states has to be kept, and those of one pair of columns at a time.

Going outside and coming back is folded into the travel between the two toolpaths, so that what a state waits
for is but the travels of its own steps, and those to the left column's steps are worked out for all
down-sets of the right column at once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.streamed_columns import Layout, PairColumn, pair_column
from slicer.sequence.bound.streamed_states import PairStates
from slicer.sequence.states import holds


class Values(NamedTuple):
    """The least cost to the end of a pair's walk, by state and place of the nozzle; see ``PairStates``.

    Attributes:
        outside: float64, left and right of the pair.
        left: float64, at the end of each oriented maximal element of the left column's down-set.
        right: float64, the same of the right column's.
    """

    outside: NDArray[np.float64]
    left: NDArray[np.float64]
    right: NDArray[np.float64]


@kernel
def evaluate_pair(
    layout: Layout, price: NDArray[np.float64], c: int, states: PairStates, values: Values
) -> None:
    """Fill the values of columns c and c + 1 at these prices, from everything printed back to nothing.

    Infinite where the down-sets do not go together, and after a toolpath that may not be printed so.
    """
    left, right = pair_column(layout, price, c, 0), pair_column(layout, price, c, 1)
    a0, b0 = layout.set_start[c], layout.set_start[c + 1]
    a, b, size = b0 - a0, len(right.top_start) - 1, right.way.shape[1]
    most = 0
    for column in (left, right):
        for s in range(len(column.top_start) - 1):
            most = max(most, column.top_start[s + 1] - column.top_start[s])
            most = max(most, column.step_start[s + 1] - column.step_start[s])
    back, over = np.empty(size), np.empty((most, size))
    # The least costs of the states of a down-set i by way of the left column's steps: where the nozzle comes
    # from the left and the right, from each maximal element of i, and from those of the right column.
    by_left, by_right = np.empty(b), np.empty(b)
    by_own, by_other = np.empty((most, b)), np.empty(len(right.top_path))
    row = np.full(len(right.top_path), np.inf)  # values.right of i; those beyond its states are infinite
    enter_left, enter_right = right.way[ENTER_LEFT][right.step_path], right.way[ENTER_RIGHT][right.step_path]
    after = np.empty(most)  # what is left after each step of the right column
    cross, tied = layout.seam[c + 1] - layout.seam[c], layout.member.shape[1] > 0
    for i in range(a - 1, -1, -1):
        begin, stop = states.low[i], states.high[i]
        first_top, tops = left.top_start[i], left.top_start[i + 1] - left.top_start[i]
        first_step, steps = left.step_start[i], left.step_start[i + 1] - left.step_start[i]
        near = (
            2 * (layout.touched[0, b0 + begin] - layout.begin[c + 1]),
            2 * (layout.touched[1, b0 + stop - 1] + 1 - layout.begin[c + 1]),
        )
        for j in range(begin, stop):
            by_left[j] = by_right[j] = np.inf
        for p in range(tops):
            by_own[p, begin:stop] = np.inf
        by_other[right.top_start[begin] : right.top_start[stop]] = np.inf
        for q in range(steps):
            v, to = left.step_path[first_step + q], left.step_set[first_step + q]
            low, high = max(begin, states.low[to]), min(stop, states.high[to])
            if low >= high:
                continue  # one step of a short column leaves the corridor
            at = states.left[to] + (left.step_top[first_step + q] - left.top_start[to]) * (
                states.high[to] - states.low[to]
            )
            rest = values.left[at + low : at + high]
            _lower(by_left[low:high], left.way[ENTER_LEFT, v], rest)
            _lower(by_right[low:high], left.way[ENTER_RIGHT, v], rest)
            for p in range(tops):
                _lower(by_own[p, low:high], left.arc[left.arc_start[i] + p * steps + q], rest)
            _into(left, right, v, near, back)
            for t in range(right.top_start[low], right.top_start[high]):
                by_other[t] = min(by_other[t], back[right.top_path[t]] + rest[right.top_set[t] - low])
        for p in range(tops):
            _out_of(left, right, left.top_path[first_top + p], near, over[p])
        row[right.top_start[stop] :] = np.inf
        own = values.left[states.left[i] + begin : states.left[i] + begin + tops * (stop - begin)]
        # This is written out, and is no function: it is done for each state, and to pass what it takes would
        # take longer.
        for j in range(stop - 1, begin - 1, -1):
            if i == a - 1 and j == b - 1:
                _finish(left, right, states, values, row)
                continue
            if tied and not (
                holds(layout.member, a0 + i, layout.needed[0], b0 + j)
                and holds(layout.member, b0 + j, layout.needed[1], a0 + i)
            ):
                _bar(right, states, values, row, (i, j, tops))
                continue
            first, last = right.step_start[j], right.step_start[j + 1]
            from_left, from_right = by_left[j], by_right[j]
            for e in range(first, last):
                rest_e = row[right.step_top[e]]
                after[e - first] = rest_e
                from_left = min(from_left, enter_left[e] + rest_e)
                from_right = min(from_right, enter_right[e] + rest_e)
            outside = states.outside[i] + 2 * j
            values.outside[outside] = min(from_left, from_right + cross)
            values.outside[outside + 1] = min(from_right, from_left + cross)
            arc = right.arc_start[j]
            for t in range(right.top_start[j], right.top_start[j + 1]):
                best = by_other[t]
                for e in range(last - first):
                    best = min(best, right.arc[arc] + after[e])
                    arc += 1
                row[t] = best
            for p in range(tops):
                best = by_own[p, j]
                for e in range(first, last):
                    best = min(best, over[p, right.step_path[e]] + after[e - first])
                own[p * (stop - begin) + j - begin] = best
        at = states.right[i]
        for t in range(right.top_start[begin], right.top_start[stop]):
            values.right[at + t] = row[t]


@inner_kernel
def _lower(least: NDArray[np.float64], cost: float, rest: NDArray[np.float64]) -> None:
    for j in range(min(len(least), len(rest))):
        least[j] = min(least[j], cost + rest[j])


@inner_kernel
def _into(
    left: PairColumn, right: PairColumn, v: int, near: tuple[int, int], back: NDArray[np.float64]
) -> None:
    """What the travel from each near toolpath of the right column to v of the left one costs, see ``arc``."""
    x, y, own = left.place[2, v], left.place[3, v], left.price[1, v]
    from_left, from_right = left.way[ENTER_LEFT, v], left.way[ENTER_RIGHT, v]
    to_left, to_right = right.way[LEAVE_LEFT], right.way[LEAVE_RIGHT]
    leave_x, leave_y, price = right.place[0], right.place[1], right.price[0]
    for u in range(near[0], near[1]):
        dx, dy = leave_x[u] - x, leave_y[u] - y
        direct = np.sqrt(dx * dx + dy * dy) - (price[u] + own)
        back[u] = min(direct, min(to_left[u] + from_left, to_right[u] + from_right))


@inner_kernel
def _out_of(
    left: PairColumn, right: PairColumn, u: int, near: tuple[int, int], over: NDArray[np.float64]
) -> None:
    """What the travel from u of the left column to each near one of the right one costs, see ``arc``."""
    x, y, own = left.place[0, u], left.place[1, u], left.price[0, u]
    to_left, to_right = left.way[LEAVE_LEFT, u], left.way[LEAVE_RIGHT, u]
    from_left, from_right = right.way[ENTER_LEFT], right.way[ENTER_RIGHT]
    enter_x, enter_y, price = right.place[2], right.place[3], right.price[1]
    for v in range(near[0], near[1]):
        dx, dy = x - enter_x[v], y - enter_y[v]
        direct = np.sqrt(dx * dx + dy * dy) - (own + price[v])
        over[v] = min(direct, min(to_left + from_left[v], to_right + from_right[v]))


@inner_kernel
def _finish(
    left: PairColumn, right: PairColumn, states: PairStates, values: Values, row: NDArray[np.float64]
) -> None:
    """The values where all is printed: the sequence ends here, or goes on outside at a price below zero."""
    i, j = len(left.top_start) - 2, len(right.top_start) - 2
    at = states.outside[i] + 2 * j
    values.outside[at] = values.outside[at + 1] = 0.0
    at = states.left[i] + j
    for t in range(left.top_start[i], left.top_start[i + 1]):
        values.left[at] = _ended(left, left.top_path[t])
        at += states.high[i] - states.low[i]
    for t in range(right.top_start[j], right.top_start[j + 1]):
        row[t] = _ended(right, right.top_path[t])


@inner_kernel
def _ended(column: PairColumn, u: int) -> float:
    leave = min(column.way[LEAVE_LEFT, u], column.way[LEAVE_RIGHT, u])
    return float(min(0.0, leave)) if column.price[0, u] > -np.inf else np.inf


@inner_kernel
def _bar(
    right: PairColumn,
    states: PairStates,
    values: Values,
    row: NDArray[np.float64],
    state: tuple[int, int, int],
) -> None:
    """The values of down-sets i, with so many maximal elements, and j that do not go together."""
    i, j, tops = state
    at = states.outside[i] + 2 * j
    values.outside[at] = values.outside[at + 1] = np.inf
    for p in range(tops):
        values.left[states.left[i] + p * (states.high[i] - states.low[i]) + j] = np.inf
    for t in range(right.top_start[j], right.top_start[j + 1]):
        row[t] = np.inf
