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

from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.pair_costs import START_SHARE
from slicer.sequence.bound.streamed_columns import Layout
from slicer.sequence.bound.streamed_dp import Values, evaluate_pair
from slicer.sequence.bound.streamed_states import PairStates, StateValues, pair_states, room_for
from slicer.sequence.bound.streamed_subgradient import add_pair_subgradient
from slicer.sequence.bound.subgradient_ascent import MOMENTUM
from slicer.sequence.states import (
    NONE,
    DownSets,
    Section,
    extent,
    needed,
    needs,
    set_sizes,
)

EVERYTHING = 1.0
MOST_KEPT = 400_000_000
"""Values of all pairs that are held at once, at 4 bytes."""


class StreamedBound:
    """The straight-travel bound on all sequences of a section.

    Attributes:
        bound: no sequence travels less, in mm; minus infinity before the first step.
        order: int64 (n,), the section's toolpaths column by column, as this class numbers them.
        columns: how many there are.
        column: int32 (n,), the column of each toolpath, as the section numbers both.
        tied: whether toolpaths wait for others of other columns.
        layout: the section, its toolpaths so numbered.
        starts: the first toolpaths that there may be: oriented, its column, down-set, and its place in that.
        price: float64 (4, 2n), where the ascent is: the prices of ``pair_costs``, in mm.
        best: those of ``bound``.
        states: of each pair of neighbouring columns, which are looked at.
        inner: bool (2n,), the oriented toolpaths that have prices: those of all columns but the outer two.
    """

    def __init__(self, section: Section, sets: DownSets) -> None:
        """Set up the bound; ``sets`` must be complete and of two columns at least, the end free."""
        columns = section.columns
        order = self.order = np.lexsort((_earliest(sets, section.n), section.column))
        number = np.empty(section.n, np.int32)
        number[order] = np.arange(section.n, dtype=np.int32)
        begin = np.searchsorted(section.column[order], np.arange(columns + 1)).astype(np.int32)
        point = np.ascontiguousarray(section.segments[order].reshape(-1, 2))
        x = [point[2 * a : 2 * b, 0] for a, b in pairwise(begin)]
        self.layout = Layout(
            begin,
            section.column[order],
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
            _touched(sets, number),
            *_ties(section, sets),
        )
        self.column = section.column
        self.columns, self.tied = columns, len(section.ties) > 0
        oriented = np.repeat(np.arange(columns), 2 * np.diff(begin))
        self.inner = (oriented > 0) & (oriented < columns - 1)
        self.starts = [self._first_step(2 * int(number[u >> 1]) + (int(u) & 1)) for u in section.starts]
        self._sets, self._sizes = sets, set_sizes(sets)
        states, self._arcs = extent(sets, np.arange(columns, dtype=np.int32))
        self._everything = 2 * states
        self.look_at(EVERYTHING)
        self.price = _first_prices(begin, point) * self.inner
        self.best = self.price
        self._direction = np.zeros_like(self.price)
        self._walked = self.starts[0]

    def look_at(self, slack: float) -> None:
        """Look at the states whose two columns are done alike but for a part ``slack`` of them.

        With ``EVERYTHING`` at all of them; else ``bound`` is one on the sequences alone that keep to these.
        """
        self.states: list[PairStates] = [
            pair_states(self._sets, self._sizes, c, slack) for c in range(self.columns - 1)
        ]
        room = np.max([states.size for states in self.states], axis=0)
        self._values = Values(*(np.empty(size) for size in room))
        self.bound = -np.inf

    @property
    def oriented(self) -> NDArray[np.intp]:
        """int (2n,), the section's numbers of the oriented toolpaths, as this class numbers them."""
        return np.stack([2 * self.order, 2 * self.order + 1], axis=1).ravel()

    @property
    def arcs(self) -> float:
        """About how many travels one evaluation looks at."""
        shown = sum(int(states.size[0]) for states in self.states)
        return self._arcs * shown / self._everything

    def step(self, length: float, out_of_time: Callable[[], bool]) -> bool:
        """One step along a moving average of subgradients.

        Args:
            length: in mm, by how much the bound would rise if it went on as it begins.
            out_of_time: is asked between columns.

        Returns:
            False if time ran out before the end, or if there is nowhere to go from where it has come to.
        """
        subgradient = np.zeros_like(self.price)
        bound = self.evaluate(subgradient, out_of_time)
        if bound is None:
            return False
        if bound == np.inf:
            self.bound = bound
            return False
        if bound > self.bound:
            self.bound, self.best = bound, self.price
        self._direction = MOMENTUM * self._direction + (1 - MOMENTUM) * subgradient * self.inner
        norm = float((self._direction**2).sum())
        if norm == 0.0:
            return False
        self.price = self.price + (1 - MOMENTUM) * length / norm * self._direction
        return True

    def evaluate(self, subgradient: NDArray[np.float64], out_of_time: Callable[[], bool]) -> float | None:
        """The bound at ``price``, or None if time ran out; ``subgradient`` is added to.

        Infinite where no sequence keeps to the states that are looked at.
        """
        layout = self.layout
        by_start = np.zeros(len(self.starts))
        for c in range(self.columns - 1):
            if out_of_time():
                return None
            states, values = self.states[c], self._values
            evaluate_pair(layout, self.price, c, states, values)
            for t, start in enumerate(self.starts):
                by_start[t] += self._root(c, start)
            if not np.isfinite(by_start).any():
                return np.inf  # no sequence keeps to these states
            u, column, to, _ = self._walked
            to -= int(layout.set_start[column])
            if column == c:
                walk = to, 0, u, 0
            elif column == c + 1:
                walk = 0, to, u, 0
            else:
                walk = 0, 0, NONE, 1 if column > c else 0
            if self._is_near(self._walked):
                add_pair_subgradient(layout, self.price, c, states, values, walk, subgradient)
        # The walks of the next step begin where the bound is least now.
        self._walked = self.starts[int(by_start.argmin())]
        return float(by_start.min())

    def all_values(self, out_of_time: Callable[[], bool]) -> StateValues | None:
        """The values of all pairs at the best prices, over the states that are looked at.

        None if they are more than ``MOST_KEPT``, or if time ran out.
        """
        if sum(int(states.size.sum()) for states in self.states) > MOST_KEPT:
            return None
        known, done = room_for(self.states), np.zeros(3, np.int64)
        for c, states in enumerate(self.states):
            if out_of_time():
                return None
            evaluate_pair(self.layout, self.best, c, states, self._values)
            for whole, part, at, size in zip(known[1:], self._values, done, states.size, strict=True):
                whole[at : at + size] = part[:size]
            done += states.size
        return known

    def _first_step(self, u: int) -> tuple[int, int, int, int]:
        """Oriented toolpath u as the first: u, its column, the down-set of it alone, its place at the top."""
        layout = self.layout
        column = int(np.searchsorted(layout.begin, u >> 1, side="right")) - 1
        empty = layout.set_start[column]
        steps = slice(layout.step_start[empty], layout.step_start[empty + 1])
        e = int(steps.start + np.flatnonzero(layout.step_path[steps] == u >> 1)[0])
        to = int(layout.step_to[e])
        return u, column, to, int(layout.top_start[to] + layout.step_slot[e])

    def _is_near(self, start: tuple[int, int, int, int]) -> bool:
        """Whether the state after a start is looked at."""
        _, column, to, _ = start
        i = to - int(self.layout.set_start[column])
        return (column + 1 == self.columns or self.states[column].low[i] == 0) and (
            column == 0 or i < int(self.states[column - 1].high[0])
        )

    @property
    def near_starts(self) -> list[tuple[int, int, int, int]]:
        """The starts whose states are looked at."""
        return [start for start in self.starts if self._is_near(start)]

    def _root(self, c: int, start: tuple[int, int, int, int]) -> float:
        """What the walk through columns c and c + 1 costs if the sequence begins with this start."""
        u, column, to, top = start
        states, values, layout = self.states[c], self._values, self.layout
        if not self._is_near(start):
            return np.inf
        if column == c:
            i, p = to - int(layout.set_start[c]), top - int(layout.top_start[to])
            return float(values.left[states.left[i] + (2 * p + (u & 1)) * (states.high[i] - states.low[i])])
        if column == c + 1:
            t = top - int(layout.top_start[layout.set_start[column]])
            return float(values.right[states.right[0] + 2 * t + (u & 1)])
        return float(values.outside[1 if column > c else 0])


def _earliest(sets: DownSets, n: int) -> NDArray[np.int64]:
    """int64 (n,), the least down-set that each toolpath is in, so that one in their order can be printed."""
    out = np.full(n, sets.start[-1], np.int64)
    np.minimum.at(out, sets.step_path, sets.step_to)
    return out


def _touched(sets: DownSets, number: NDArray[np.int32]) -> NDArray[np.int32]:
    """``touched`` of a ``Layout``."""
    out = np.array([[len(number)], [-1]]).repeat(sets.start[-1], axis=1)
    for start, path in ((sets.step_start, sets.step_path), (sets.top_start, sets.top_path)):
        of = np.repeat(np.arange(sets.start[-1]), np.diff(start))
        np.minimum.at(out[0], of, number[path])
        np.maximum.at(out[1], of, number[path])
    for a, b in pairwise(sets.start):
        out[0, a:b] = np.minimum.accumulate(out[0, a:b][::-1])[::-1]
        out[1, a:b] = np.maximum.accumulate(out[1, a:b])
    return out.astype(np.int32)


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
