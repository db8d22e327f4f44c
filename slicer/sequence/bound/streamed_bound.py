"""The column-pair bound of sheets too large to hold, one pair of columns at a time.

The same decomposition as in ``pair_costs``, without multipliers for travels inside a column, which both
pairs that see it pay half of. Time and memory go with the greatest number of down-sets of two neighbouring
columns, so that sheets of a hundred columns have a bound as well.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from slicer.sequence.bound.jumps import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.pair_costs import START_SHARE
from slicer.sequence.bound.streamed_dp import Layout, Values, evaluate_pair
from slicer.sequence.bound.streamed_subgradient import add_pair_subgradient
from slicer.sequence.bound.subgradient_ascent import MOMENTUM, PATIENCE, SHRINK
from slicer.sequence.problem import Search
from slicer.sequence.states import (
    NONE,
    DownSets,
    Section,
    all_down_sets,
    extent,
    join_tied_columns,
    needed,
    needs,
)

FIRST_STEP = 0.2
USUAL_GAP = 0.06
"""The optimum is hardly further above the first bounds than this; sequences of large sheets may be."""
MOST_DOWN_SETS = 6_000
"""A column with more has too many for a bound."""
MOST_VALUES = 60_000_000
"""Values of the states of two columns, at 8 bytes; more count as too many as well."""
ARCS = {"quick": 200_000_000, "default": 2_500_000_000, "high": 20_000_000_000}
"""Travels looked at in all steps, at about 1.6 ns each."""
STRETCH = 4
"""The one step that there is at least may look at so many times as many travels."""
MOST_STEPS = 60


def raise_streamed_bound(search: Search) -> None:
    """Raise a search's bound on straight travel by as many steps as the effort allows.

    Where there can be none the bound stays as it is, and the progress says why. For other objectives, which
    it does not price, it does nothing.
    """
    if search.objective.routed:
        return None
    section = join_tied_columns(Section.whole(search.problem, search.objective))
    if section.columns < 2:
        return search.report("a single column, no bound")
    sets = all_down_sets(section, MOST_DOWN_SETS)
    if sets is None or max(_room(sets)) > MOST_VALUES:
        return search.report("columns with too many down-sets for a bound")
    arcs = extent(sets, np.arange(section.columns, dtype=np.int32))[1]
    if arcs > STRETCH * ARCS[search.effort]:
        return search.report("a sheet too large for a bound with this effort")
    bound = StreamedBound(section, sets)
    for _ in range(max(1, min(MOST_STEPS, ARCS[search.effort] // arcs))):
        if search.proved or not bound.improve(search.cost, search.should_stop):
            return None
        search.raise_bound_on_all(bound.bound)
        search.report("bound")
    return None


def _room(sets: DownSets) -> tuple[int, int, int]:
    """The most values that two columns have: outside, at ends in the left one, and in the right one."""
    count, tops = sets.counts.tolist(), (2 * np.diff(sets.top_start[sets.start])).tolist()
    pairs = list(pairwise(zip(count, tops, strict=True)))
    return (
        max(2 * a * b for (a, _), (b, _) in pairs),
        max(s * b for (_, s), (b, _) in pairs),
        max(a * t for (a, _), (_, t) in pairs),
    )


class StreamedBound:
    """The straight-travel bound on all sequences of a section.

    Attributes:
        bound: no sequence travels less, in mm; minus infinity before the first step.
        order: int64 (n,), the section's toolpaths column by column, as this class numbers them.
        price: float64 (4, 2n), where the ascent is: the prices of ``pair_costs``, in mm.
        inner: bool (2n,), the oriented toolpaths that have prices: those of all columns but the outer two.
    """

    def __init__(self, section: Section, sets: DownSets) -> None:
        """Set up the bound; ``sets`` must be complete and of two columns at least, the end free."""
        columns = section.columns
        order = self.order = np.argsort(section.column, kind="stable")
        number = np.empty(section.n, np.int32)
        number[order] = np.arange(section.n, dtype=np.int32)
        begin = np.searchsorted(section.column[order], np.arange(columns + 1)).astype(np.int32)
        point = np.ascontiguousarray(section.segments[order].reshape(-1, 2))
        x = [point[2 * a : 2 * b, 0] for a, b in pairwise(begin)]
        self._layout = Layout(
            begin,
            point,
            np.array([0.5 * (of_column.min() + of_column.max()) for of_column in x]),
            sets.start,
            sets.step_start,
            number[sets.step_path],
            sets.step_to,
            sets.step_slot,
            sets.top_start,
            number[sets.top_path],
            section.allowed[order].ravel(),
            *_ties(section, sets),
        )
        self._columns = columns
        oriented = np.repeat(np.arange(columns), 2 * np.diff(begin))
        self.inner = (oriented > 0) & (oriented < columns - 1)
        self._starts = [self._first_step(2 * int(number[u >> 1]) + (int(u) & 1)) for u in section.starts]
        self._count, self._tops = np.diff(sets.start), 2 * np.diff(sets.top_start[sets.start])
        self._room = tuple(np.empty(size) for size in _room(sets))
        self.bound = -np.inf
        self.price = _first_prices(begin, point) * self.inner
        self._best = self.price
        self._direction = np.zeros_like(self.price)
        self._walked = self._starts[0]
        self._step, self._stale = FIRST_STEP, 0

    def improve(self, target: float, out_of_time: Callable[[], bool]) -> bool:
        """One step of the ascent towards ``target``, a cost that some sequence has.

        False if time ran out before its end, or if there is nowhere to go from where it has come to.
        """
        subgradient = np.zeros_like(self.price)
        bound = self.evaluate(subgradient, out_of_time)
        if bound is None:
            return False
        if bound > self.bound:
            self.bound, self._best, self._stale = bound, self.price, 0
        else:
            self._stale += 1
            if self._stale > PATIENCE:
                self._step, self._stale = SHRINK * self._step, 0
                self.price, self._direction = self._best, np.zeros_like(self.price)
                return True
        self._direction = MOMENTUM * self._direction + (1 - MOMENTUM) * subgradient * self.inner
        norm = float((self._direction**2).sum())
        if norm == 0.0:
            return False
        gap = min(target - bound, USUAL_GAP * target) if bound > 0.0 else target - bound
        self.price = self.price + self._step * (1 - MOMENTUM) * gap / norm * self._direction
        return True

    def evaluate(self, subgradient: NDArray[np.float64], out_of_time: Callable[[], bool]) -> float | None:
        """The bound at ``price``, or None if time ran out; ``subgradient`` is added to."""
        layout = self._layout
        by_start = np.zeros(len(self._starts))
        for c in range(self._columns - 1):
            if out_of_time():
                return None
            values = self._values(c)
            evaluate_pair(layout, self.price, c, values)
            for t, start in enumerate(self._starts):
                by_start[t] += self._root(c, values, start)
            u, column, to, _ = self._walked
            i, j = int(layout.set_start[c]), int(layout.set_start[c + 1])
            if column == c:
                add_pair_subgradient(layout, self.price, c, values, (to, j), u, 0, subgradient)
            elif column == c + 1:
                add_pair_subgradient(layout, self.price, c, values, (i, to), u, 0, subgradient)
            else:
                side = 1 if column > c else 0
                add_pair_subgradient(layout, self.price, c, values, (i, j), NONE, side, subgradient)
        # The walks of the next step begin where the bound is least now.
        self._walked = self._starts[int(by_start.argmin())]
        return float(by_start.min())

    def _values(self, c: int) -> Values:
        """Room for the values of columns c and c + 1."""
        a, b = int(self._count[c]), int(self._count[c + 1])
        s, t = int(self._tops[c]), int(self._tops[c + 1])
        outside, left, right = self._room
        return Values(
            outside[: 2 * a * b].reshape(a, b, 2), left[: s * b].reshape(s, b), right[: a * t].reshape(a, t)
        )

    def _first_step(self, u: int) -> tuple[int, int, int, int]:
        """Oriented toolpath u as the first: u, its column, the down-set of it alone, its place at the top."""
        layout = self._layout
        column = int(np.searchsorted(layout.begin, u >> 1, side="right")) - 1
        empty = layout.set_start[column]
        steps = slice(layout.step_start[empty], layout.step_start[empty + 1])
        e = int(steps.start + np.flatnonzero(layout.step_path[steps] == u >> 1)[0])
        to = int(layout.step_to[e])
        return u, column, to, int(layout.top_start[to] + layout.step_slot[e])

    def _root(self, c: int, values: Values, start: tuple[int, int, int, int]) -> float:
        """What the walk through columns c and c + 1 costs if the sequence begins with this start."""
        u, column, _, top = start
        if column in (c, c + 1):
            at = 2 * (top - int(self._layout.top_start[self._layout.set_start[column]])) + (u & 1)
            return float(values.left[at, 0] if column == c else values.right[0, at])
        return float(values.outside[0, 0, 1 if column > c else 0])


def _ties(section: Section, sets: DownSets) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """``member`` and ``needed`` of a ``Layout``."""
    known = needs(section, sets, section.ties)
    of_neighbour = np.zeros((2, *known.member.shape), np.uint64)
    for c in range(section.columns - 1 if known.member.size else 0):
        left, right = slice(*sets.start[c : c + 2]), slice(*sets.start[c + 1 : c + 3])
        of_neighbour[0, right] = needed(section, sets, known, c, c + 1)
        of_neighbour[1, left] = needed(section, sets, known, c + 1, c)
    return known.member, of_neighbour


def _first_prices(begin: NDArray[np.int32], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64 (4, 2n), a share of the distance to the nearest endpoint in the column that way."""
    price = np.zeros((4, len(point)))
    points = shapely.points(point)
    for c in range(len(begin) - 2):
        left, right = slice(2 * begin[c], 2 * begin[c + 1]), slice(2 * begin[c + 1], 2 * begin[c + 2])
        for here, there, leave, enter in (
            (left, right, LEAVE_RIGHT, ENTER_RIGHT),
            (right, left, LEAVE_LEFT, ENTER_LEFT),
        ):
            nearest = shapely.STRtree(points[there]).nearest(points[here])
            share = START_SHARE * shapely.distance(points[here], points[there][nearest])
            price[enter, here] = share
            price[leave, here] = share.reshape(-1, 2)[:, ::-1].ravel()  # left at the other endpoint
    return price
