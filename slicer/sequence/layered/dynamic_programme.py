"""The optimum by dynamic programming over all states of a sheet, where one block can hold them.

A nozzle's body ties columns, and then few of their down-sets go together: 607,000 of muscle_us_8x8 under a
brass nozzle, 3.4 million of 6x6 random tiles under a needle. Where they are so few, nothing has to be
relaxed: what the rest costs at least is found backwards, for each state and each toolpath that may have been
the last (Held and Karp, "A dynamic programming approach to sequencing problems", Journal of the SIAM 10,
1962; over down-sets: Schrage and Baker, "Dynamic programming solution of sequencing problems with precedence
constraints", Operations Research 26, 1978).

What takes long is to find what stands in the way of each travel. So all of them count as straight at first:
that leads a narrow beam, and with what both ends of the sequence cost so, tells which states cannot be on the
way to anything better than it finds. On the way back, of all that may come next that is priced first which
would be the cheapest if it went straight, and others only as long as they still could be.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layered_search import RELATIVE_EPS, search_layers
from slicer.sequence.problem import CostModel, Search, direct_cost
from slicer.sequence.states import FREE, NONE, OUTSIDE, Blocks, Skylines, cost_over, sets_of_states

WIDTH, WIDE = 100, 1_000
"""Nodes of each layer of the beam. Led by what the rest of the sheet costs if travels go straight, it ends at
the optimum of muscle_us_8x8 under a brass nozzle and of 6x6 tiles under a needle in 0.3 s; from a sequence
that is a fifth dearer, all that follows takes up to six times as long. A wider one where nothing follows.
"""
MOST_LEFT = {"quick": 2_000_000, "default": 25_000_000, "high": 500_000_000}
"""Values that may be left for the way back, at 0.05 to 1.5 µs each."""
AT_ONCE = 20_000
"""States between two looks at the clock."""
SAME = 1e-7
"""The same travels, priced over what is printed of joined columns and of the sheet, differ by such a part at
most: whether a hair stands in the way is a matter of rounding. On three of 9432 random sheets it was 2e-9 to
7e-9, and less on all others.
"""
DOWN = 1.0 - 2.0**-23
"""Single precision must not round up what comes before, in any of its sums."""


class Travels(NamedTuple):
    """What travels between the toolpaths of the block cost.

    Attributes:
        direct: float64 (2n * 2n,), at least, from each oriented toolpath to each.
        segments: float64 (n, 2, 2), of the block's toolpaths in its own order.
        path, column: int32 (n,), their numbers and columns in the section.
        cost_model: of what they cost as they are made.
        sky: what stands in the way.
        set_of: int32 (s, c), the down-sets of each state, one of each column.
    """

    direct: NDArray[np.float64]
    segments: NDArray[np.float64]
    path: NDArray[np.int32]
    column: NDArray[np.int32]
    cost_model: CostModel
    sky: Skylines
    set_of: NDArray[np.int32]


class Least(NamedTuple):
    """What is known of each value of ``Blocks``.

    Attributes:
        before: float32, what comes before costs at least; infinite where nothing leads there.
        rest: float64, what comes after costs at least: as if all travels went straight, until the way back
            has passed; then as they are made, infinite if the whole is not below the cut.
        lower: float64, scratch for the steps of a state.
    """

    before: NDArray[np.float32]
    rest: NDArray[np.float64]
    lower: NDArray[np.float64]


def holds_whole(bound: PairBound) -> bool:
    """Whether travels are routed, and one block has all columns, so that its states know all that is printed.

    The block's sequence begins where the section's does, and its end is free.
    """
    return bool(bound.section.routed and bound.blocks.blocks == 1 and bound.section.last == NONE)


def prove_over_all_states(search: Search, bound: PairBound) -> None:
    """Find the optimum and offer it.

    Where time runs out, or too many states are left for the effort, the bound is that of straight travels.

    Args:
        search: has a sequence.
        bound: over all states, see ``holds_whole``. Its values are used up.
    """
    blocks = bound.blocks
    bound.use_best_multipliers()
    search.raise_bound_on_all(bound.bound)
    search.report("bound")
    if search.proved or search.should_stop():
        return
    _offer_beam(search, bound, WIDTH)
    if search.should_stop():
        return
    travels, starts = _travels(bound), bound.ends.start_value[:, 0]
    steps = int(np.diff(blocks.move_start).max())
    least = Least(np.full(len(bound.value), np.inf, np.float32), bound.value, np.empty(2 * steps))
    least.before[starts] = 0.0
    states, below = len(blocks.dense), search.cost - RELATIVE_EPS * search.cost
    for first in range(0, states, AT_ONCE):
        if search.should_stop():
            return
        _go_forwards(blocks, travels.direct, least, below, first, min(first + AT_ONCE, states))
    if np.count_nonzero(least.before < np.inf) > MOST_LEFT[search.effort]:
        return _offer_beam(search, bound, WIDE)
    for last in range(states, 0, -AT_ONCE):
        if search.should_stop():
            return
        _come_back(blocks, travels, least, below, max(0, last - AT_ONCE), last)
    search.nodes_visited += states
    search.states_created += len(bound.value)
    begin = int(np.argmin(least.rest[starts]))
    cost = float(least.rest[starts[begin]])
    if np.isfinite(cost):
        oriented = np.empty(bound.section.n, np.int32)
        oriented[0] = bound.ends.starts[begin]
        _follow(blocks, travels, least, int(starts[begin]), oriented)
        search.offer(oriented)
    search.raise_bound(np.inf if search.cost <= cost * (1.0 + SAME) else cost)
    search.report("all states")


def _offer_beam(search: Search, bound: PairBound, width: int) -> None:
    found = search_layers(search, bound, search.cost, width)
    search.nodes_visited += found.nodes
    search.states_created += found.generated
    search.offer(found.oriented)
    search.report("search")


def _travels(bound: PairBound) -> Travels:
    section, path = bound.section, bound.blocks.path
    _, set_of = sets_of_states(bound.blocks, bound.sets)
    return Travels(
        bound.block_costs.direct,
        section.segments[path],
        path,
        section.column[path],
        section.cost_model,
        bound.sky,
        set_of.reshape(len(bound.blocks.dense), -1),
    )


@kernel
def _go_forwards(
    blocks: Blocks, direct: NDArray[np.float64], least: Least, below: float, first: int, last: int
) -> None:
    """Go on from states first .. last - 1 as if travels went straight, where the whole may be below a cut."""
    move_start, move_path, move_value = blocks.move_start, blocks.move_path, blocks.move_value
    before, rest, stride = least.before, least.rest, 2 * len(blocks.path)
    for s in range(first, last):
        for x in range(blocks.value_start[s] + OUTSIDE, blocks.value_start[s + 1]):
            if not before[x] + rest[x] < below:
                before[x] = np.inf
                continue
            row = stride * blocks.value_path[x]
            for m in range(move_start[s], move_start[s + 1]):
                at, to = row + 2 * move_path[m], move_value[m]
                for f in range(2):
                    least_there = np.float32(DOWN * (before[x] + direct[at + f]))
                    before[to + f] = min(before[to + f], least_there)


@kernel
def _come_back(blocks: Blocks, travels: Travels, least: Least, below: float, first: int, last: int) -> None:
    """Find what is left to pay from states last - 1 .. first on, those behind them being known."""
    before, rest = least.before, least.rest
    end = len(blocks.dense) - 1
    for s in range(last - 1, first - 1, -1):
        for x in range(blocks.value_start[s] + OUTSIDE, blocks.value_start[s + 1]):
            left = below - before[x]
            if before[x] == np.inf:
                rest[x] = np.inf
            elif s != end:
                rest[x] = _cheapest(blocks, travels, least, s, x, left)[0]


@kernel
def _follow(blocks: Blocks, travels: Travels, least: Least, x: int, oriented: NDArray[np.int32]) -> None:
    """Fill in the sequence of the least cost from a value of a first toolpath on."""
    s = 0
    for k in range(1, len(oriented)):
        while blocks.value_start[s + 1] <= x:
            s += 1
        chosen = _cheapest(blocks, travels, least, s, x, np.inf)[1]
        m = blocks.move_start[s] + chosen // 2
        oriented[k] = 2 * blocks.path[blocks.move_path[m]] + chosen % 2
        x = blocks.move_value[m] + chosen % 2


@inner_kernel
def _cheapest(
    blocks: Blocks, travels: Travels, least: Least, s: int, x: int, below: float
) -> tuple[float, int]:
    """The least cost from value x of state s on, and how it goes on: twice the number of the step, and 1 for
    its direction 1. Infinity and ``NONE`` where all is as dear as ``below``.
    """
    lower, rest = least.lower, least.rest
    u = blocks.value_path[x]
    first, count = blocks.move_start[s], blocks.move_start[s + 1] - blocks.move_start[s]
    row = 2 * len(blocks.path) * u
    for m in range(count):
        at, to = row + 2 * blocks.move_path[first + m], blocks.move_value[first + m]
        lower[2 * m] = travels.direct[at] + rest[to]
        lower[2 * m + 1] = travels.direct[at + 1] + rest[to + 1]
    best, chosen = below, NONE
    while True:
        cost, at = best, NONE
        for q in range(2 * count):
            if lower[q] < cost:
                cost, at = lower[q], q
        if at == NONE:
            break
        lower[at] = np.inf
        v = 2 * blocks.move_path[first + at // 2] + at % 2
        cost += _detour(travels, s, u, v, travels.direct[row + v])
        if cost < best:
            best, chosen = cost, at
    return (best if chosen != NONE else np.inf), chosen


@inner_kernel
def _detour(travels: Travels, s: int, u: int, v: int, least: float) -> float:
    """What the travel from oriented toolpath u to v costs more than ``least``, over what state s has."""
    segments, a, b = travels.segments, u >> 1, v >> 1
    start = (segments[a, 1 - (u & 1), 0], segments[a, 1 - (u & 1), 1])
    end = (segments[b, v & 1, 0], segments[b, v & 1, 1])
    cost = cost_over(
        travels.cost_model,
        travels.sky,
        travels.set_of[s],
        (travels.column[a], travels.column[b]),
        (travels.path[a], segments[a]),
        start,
        end,
    )
    if cost == FREE:  # a hop that is joined may cost more than one that has to rise
        cost = direct_cost(travels.cost_model, end[0] - start[0], end[1] - start[1])
    return max(0.0, cost - least)
