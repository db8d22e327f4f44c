"""A lower bound on tours without precedence by linear programming.

A tour alternates between toolpaths and travels, so its travels are a perfect matching of the toolpaths'
ends that joins all toolpaths. Relaxed to parts of travels: each end has travels of 1 in all; at least 1
leaves a set of an odd number of ends (Edmonds, Journal of Research of the National Bureau of Standards 69B,
1965), at least 2 a set of whole toolpaths (Dantzig, Fulkerson and Johnson, Operations Research 2, 1954).
These rows are added where the solution so far breaks them, and travels where they would make it cheaper:
few are in it, but the bound holds for all.

A sequence becomes a tour by a toolpath of no length, ends 2n and 2n + 1, from and to which travels cost
nothing; from the first of them only to where the sequence may begin. HiGHS solves the programs, each from
what it had before.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.rural_postman.violated_sets import Sets, growing_sets, least_left, odd_sets

MOST_PRICED = 200_000
CHEAPER = 1e-7
"""A travel that is not in the program makes it cheaper if its reduced cost is below this, negated."""
STALE, RISE = 12, 2e-5
"""The bound is as good as it gets once it rises by less than this part in so many rounds."""


class Prices(NamedTuple):
    """What the dual program says of ends.

    Attributes:
        whole: float64 (nodes,), an end's price, with those of all sets that it is in.
        start: int64 (nodes + 1,), where an end's sets begin in ``sets``.
        sets: int64 (k,), in rising order for each end.
        dual: float64, the price of each set.
    """

    whole: NDArray[np.float64]
    start: NDArray[np.int64]
    sets: NDArray[np.int64]
    dual: NDArray[np.float64]


class Relaxation:
    """The linear program, as far as it has been built.

    Attributes:
        points: float64 (2n, 2), the toolpaths' ends in mm.
        begins: bool (2n,), where the sequence may begin.
        nodes: 2n + 2, the ends.
        travels: int64 (m, 2), ends that the program's travels join, the smaller number first.
        part: float64 (m,), how much of each travel the last solution has.
        reduced: float64 (m,), their reduced costs in mm.
        bound: no tour is shorter, in mm.
    """

    def __init__(
        self, points: NDArray[np.float64], begins: NDArray[np.bool_], travels: NDArray[np.int64]
    ) -> None:
        """Begin with some travels, (m, 2), among which there is a tour."""
        self.points, self.begins, self.nodes = points, begins, len(points) + 2
        self.bound = 0.0
        self.travels = np.empty((0, 2), np.int64)
        self.part = self.reduced = np.empty(0)
        self._member = np.zeros((0, self.nodes), np.bool_)
        self._least = np.empty(0)
        self._known: set[bytes] = set()
        self._price = np.zeros(self.nodes)
        self._model = quiet_model()
        ones = np.ones(self.nodes)
        none = np.empty(0, np.int32)
        self._model.addRows(self.nodes, ones, ones, 0, np.zeros(self.nodes, np.int32), none, np.empty(0))
        self._add_travels(np.unique(np.sort(travels, axis=1), axis=0))

    def raise_bound(self, rounds: int, should_stop: Callable[[], bool] = lambda: False) -> None:
        """Solve, add what is missing, and solve again, at most so many times and until it should stop."""
        history = []
        for _ in range(rounds):
            self._solve()
            if should_stop():
                break
            sets = self._grown()
            if not self._add_sets(sets):
                if self._add_travels(self._missing()):
                    continue
                history.append(self.bound)
                stale = len(history) > STALE and self.bound - history[-STALE] < RISE * self.bound
                if stale or not self._add_sets(self._exact()):
                    break
        self._solve()
        self._missing()

    def binding(self) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """bool (k, nodes), the sets that the bound rests on, and how much has to leave each."""
        chosen = self._price[self.nodes :] > 0.0
        return self._member[chosen], self._least[chosen]

    def lengths(self, travels: NDArray[np.int64]) -> NDArray[np.float64]:
        """Of each travel, in mm."""
        n2 = len(self.points)
        steps = (
            self.points[np.minimum(travels[:, 0], n2 - 1)] - self.points[np.minimum(travels[:, 1], n2 - 1)]
        )
        return np.where((travels < n2).all(axis=1), np.hypot(steps[:, 0], steps[:, 1]), 0.0)

    def near(self, count: int) -> NDArray[np.int32]:
        """int32 (2n, count), to which ends travels from each have the least reduced costs; -1 for none."""
        inside = (self.travels < len(self.points)).all(axis=1)
        travels, cost = self.travels[inside], np.round(self.reduced[inside], 9)
        both, length = np.concatenate([travels, travels[:, ::-1]]), self.lengths(travels)
        order = np.lexsort((np.tile(length, 2), np.tile(cost, 2), both[:, 0]))
        both = both[order]
        place = np.arange(len(both)) - np.searchsorted(both[:, 0], both[:, 0])
        out = np.full((len(self.points), count), -1, np.int32)
        out[both[place < count, 0], place[place < count]] = both[place < count, 1]
        return out

    def _solve(self) -> None:
        self._model.run()
        solution = self._model.getSolution()
        self.part, self.reduced = np.array(solution.col_value), np.array(solution.col_dual)
        self._price = np.array(solution.row_dual)
        self._price[self.nodes :] = np.maximum(self._price[self.nodes :], 0.0)

    def _grown(self) -> list[tuple[Sets, float]]:
        travels, part = self._present()
        toolpaths = growing_sets(self.nodes // 2, travels >> 1, part, odd=False)
        return [(_ends_of(toolpaths), 2.0), (growing_sets(self.nodes, travels, part, odd=True), 1.0)]

    def _exact(self) -> list[tuple[Sets, float]]:
        travels, part = self._present()
        return [
            (_ends_of(least_left(self.nodes // 2, travels >> 1, part)), 2.0),
            (odd_sets(self.nodes, travels, part), 1.0),
        ]

    def _present(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        present = self.part > CHEAPER
        return self.travels[present], self.part[present]

    def _add_sets(self, found: list[tuple[Sets, float]]) -> bool:
        """Add a row for each set of ends that has none yet; whether there were any."""
        rows, least = [], []
        for sets, leaving in found:
            for chosen in sets:
                row = np.zeros(self.nodes, np.bool_)
                row[chosen] = True
                if 2 * len(chosen) > self.nodes:
                    row = ~row
                key = np.packbits(row).tobytes()
                if key not in self._known:
                    self._known.add(key)
                    rows.append(row)
                    least.append(leaving)
        if rows:
            member, needed = np.array(rows), np.array(least)
            add_leaving(self._model, self.travels, member, needed)
            self._member = np.concatenate([self._member, member])
            self._least = np.concatenate([self._least, needed])
        return bool(rows)

    def _add_travels(self, travels: NDArray[np.int64]) -> bool:
        """Add columns that the program does not have; whether there were any."""
        if not len(travels):
            return False
        m = len(travels)
        crossing = self._member[:, travels[:, 0]] != self._member[:, travels[:, 1]]
        rows = [
            np.concatenate([ends, self.nodes + np.flatnonzero(crossing[:, k])])
            for k, ends in enumerate(travels)
        ]
        start = np.cumsum([0, *map(len, rows)])
        self._model.addCols(
            m, self.lengths(travels), np.zeros(m), np.full(m, np.inf), int(start[-1]),
            start[:-1].astype(np.int32), np.concatenate(rows).astype(np.int32), np.ones(start[-1]),
        )  # fmt: skip
        self.travels = np.concatenate([self.travels, travels])
        return True

    def _missing(self) -> NDArray[np.int64]:
        """Travels that would make the solution cheaper; raises the bound to what holds for all of them.

        Were the price of an end lower by half of what its cheapest travel is below 0, and so at every end, no
        travel would be: that is a solution of the dual program, whose value is a bound.
        """
        price, dual = self._price[: self.nodes], self._price[self.nodes :]
        active = np.flatnonzero(dual > 0.0)
        member, dual = self._member[active], dual[active]
        inside = np.nonzero(member.T)
        start = np.searchsorted(inside[0], np.arange(self.nodes + 1))
        at_end = Prices(price + dual @ member, start.astype(np.int64), inside[1].astype(np.int64), dual)
        out, below = np.empty((MOST_PRICED, 2), np.int64), np.zeros(self.nodes)
        count = _cheaper(self.points, self.begins, at_end, out, below)
        self.bound = max(self.bound, float(price.sum() + dual @ self._least[active] - below.sum() / 2))
        key = out[:count] @ np.array([self.nodes, 1])
        return out[:count][~np.isin(key, self.travels @ np.array([self.nodes, 1]))]


def quiet_model() -> Any:
    """A model of HiGHS that prints nothing and keeps to one thread, so that it gives the same every time."""
    import highspy

    # Once it sets up callbacks, of which we use none, it names itself on stdout, where tables go.
    quiet = type("Quiet", (highspy.Highs,), {"enableCallbacks": lambda model: None})
    model = quiet()
    model.silent()
    model.setOptionValue("threads", 1)
    return model


def add_leaving(
    model: Any, travels: NDArray[np.int64], member: NDArray[np.bool_], least: NDArray[np.float64]
) -> None:
    """Add rows to a model of these travels: so much at least leaves each set, bool (k, nodes)."""
    crossing = member[:, travels[:, 0]] != member[:, travels[:, 1]]
    sizes = crossing.sum(axis=1)
    start = (np.cumsum(sizes) - sizes).astype(np.int32)
    columns = np.nonzero(crossing)[1].astype(np.int32)
    infinite = np.full(len(member), np.inf)
    model.addRows(len(member), least, infinite, len(columns), start, columns, np.ones(len(columns)))


def _ends_of(toolpaths: Sets) -> Sets:
    return [np.concatenate([2 * chosen, 2 * chosen + 1]) for chosen in toolpaths]


@kernel
def _cheaper(
    points: NDArray[np.float64],
    begins: NDArray[np.bool_],
    prices: Prices,
    out: NDArray[np.int64],
    below: NDArray[np.float64],
) -> int:
    """Fill ``out`` with travels of a reduced cost below 0, ``below`` with how far each end's is; how many."""
    n2, count = len(points), 0
    whole, start, sets, dual = prices.whole, prices.start, prices.sets, prices.dual
    for u in range(n2):
        for v in range(u + 1, n2 + 2):
            if u ^ 1 == v or (v == n2 and not begins[u]):
                continue
            cost = -whole[u] - whole[v]
            if v < n2:
                dx, dy = points[u, 0] - points[v, 0], points[u, 1] - points[v, 1]
                cost += np.sqrt(dx * dx + dy * dy)
            if cost >= 0.0:
                continue
            i, j = start[u], start[v]
            while i < start[u + 1] and j < start[v + 1]:
                if sets[i] == sets[j]:  # such a travel does not leave it
                    cost += 2.0 * dual[sets[i]]
                    i += 1
                    j += 1
                elif sets[i] < sets[j]:
                    i += 1
                else:
                    j += 1
            if cost >= 0.0:
                continue
            below[u], below[v] = max(below[u], -cost), max(below[v], -cost)
            if cost < -CHEAPER and count < len(out):
                out[count, 0], out[count, 1] = u, v
                count += 1
    return count
