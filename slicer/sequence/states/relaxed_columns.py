"""The states of all columns that a bound can afford: down-sets where these are few, else counts."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.closure import Closure, across_columns, closures_of_columns, never_follows
from slicer.sequence.states.corridor import extent, pairs_of
from slicer.sequence.states.counts_together import counts_together
from slicer.sequence.states.downsets import DownSets, all_down_sets
from slicer.sequence.states.group_counts import (
    Relaxation,
    coarse_relaxations,
    relaxations,
    with_what_follows,
)
from slicer.sequence.states.section import Section

MOST_FOLLOWING = 4_000_000
"""What may follow is told of each end and step of a column's states, at 100 bytes each while it is found."""
MOST_DOWN_SETS = 6_000
"""A column with more has too many to be worth their numbering."""
STATE_BYTES, STEP_BYTES, END_BYTES = 110, 25, 50
"""What a bound holds of each state, step and end (of a toolpath, in two directions): its blocks, values, and
as much again of those that are near, where these are most."""


@dataclass(frozen=True, eq=False)
class RelaxedColumns:
    """What the states of each column of a section may be, from the coarsest to the finest.

    Attributes:
        section: with a free end.
        choices: of each column.
        sizes: int64 (4,) of each of them: its states, their steps, their ends, and the sum of steps times
            ends.
        coarsest: for each column the number of the choice that together make the fewest travels. Finer states
            are often cheaper: what can come next is less.
        before: bool (n, n), what must come before what, by ``across_columns``.
        never: bool (n, n), by ``never_follows``; None where ``before`` is.
        closures: the same of each column.
    """

    section: Section
    choices: list[list[Relaxation]]
    sizes: list[list[NDArray[np.int64]]]
    coarsest: list[int]
    before: NDArray[np.bool_] | None
    never: NDArray[np.bool_] | None
    closures: list[Closure]

    @classmethod
    def of(cls, section: Section) -> "RelaxedColumns":
        """All choices of a section."""
        return cls.coarse(section).with_all_choices()

    @classmethod
    def coarse(cls, section: Section) -> "RelaxedColumns":
        """Of each column the choices that are made quickly: counts of a single group, and the down-sets."""
        parts = [section.part(section.column == c) for c in range(section.columns)]
        before = across_columns(section)
        never = None if before is None else never_follows(section, before)
        closures = closures_of_columns(section, before)
        choices = [
            coarse_relaxations(part, closure, MOST_DOWN_SETS)
            for part, closure in zip(parts, closures, strict=True)
        ]
        sizes = [[_size(states.sets) for states in column] for column in choices]
        columns = cls(section, choices, sizes, [0] * section.columns, before, never, closures)
        while True:
            more, c, t = min(columns._changes(_arcs, columns.coarsest), default=(0, 0, 0))
            if more >= 0:
                return columns
            columns.coarsest[c] = t

    def with_all_choices(self) -> "RelaxedColumns":
        """The same with counts of more groups between those that are made quickly; as coarse at first."""
        choices = [
            relaxations(self.section.part(self.section.column == c), closure, coarse)
            for c, (closure, coarse) in enumerate(zip(self.closures, self.choices, strict=True))
        ]
        sizes = [[_size(states.sets) for states in column] for column in choices]
        coarsest = [t and len(column) - 1 for t, column in zip(self.coarsest, choices, strict=True)]
        return replace(self, choices=choices, sizes=sizes, coarsest=coarsest)

    def arcs(self, chosen: list[int], together: list[NDArray[np.bool_]] | None = None) -> int:
        """How many travels the bound over pairs of columns looks at; see ``corridor.extent``.

        Args:
            chosen: of each column the number of its choice.
            together: which of these go together, where not all do; fewer may be reached.
        """
        if together is None:
            return _sum(_arcs, self._sizes_of(chosen))
        sets = [column[t].sets for column, t in zip(self.choices, chosen, strict=True)]
        steps = [np.diff(each.step_start).astype(float) for each in sets]
        ends = [np.diff(each.top_start).astype(float) for each in sets]
        arcs = 0.0
        for c, mask in enumerate(together):
            of, other = mask.sum(axis=1), mask.sum(axis=0)
            arcs += 4.0 * (steps[c] * ends[c]) @ of + 4.0 * (steps[c + 1] * ends[c + 1]) @ other
            arcs += 4.0 * (steps[c] @ mask @ ends[c + 1] + ends[c] @ mask @ steps[c + 1])
        return int(arcs)

    def finest(self, most_arcs: int, most_bytes: float = np.inf) -> list[int]:
        """Finer states than the coarsest, as long as there are no more travels.

        One step after the other to a finer column is taken: that which takes away the most of what may have
        been last, on average over states, for the travels that it adds.

        Args:
            most_arcs: so many travels.
            most_bytes: what the blocks may hold.
        """
        chosen = list(self.coarsest)
        arcs, held = self.arcs(chosen), _sum(_bytes, self._sizes_of(chosen))
        while True:
            best = (-np.inf, 0, 0, 0, 0)
            holds = {(c, t): more for more, c, t in self._changes(_bytes, chosen)}
            for more, c, t in self._changes(_arcs, chosen):
                now, then = self.sizes[c][chosen[c]], self.sizes[c][t]
                if t < chosen[c] or then[3] > MOST_FOLLOWING:
                    continue
                if arcs + more > most_arcs or held + holds[c, t] > most_bytes:
                    continue
                fewer = _mean_ends(now) - _mean_ends(then)
                # Where what may have been last grows, the cheapest step comes first.
                gain = fewer / max(1, more) if fewer > 0.0 else -float(max(1, more))
                best = max(best, (gain, c, t, more, holds[c, t]))
            if best[0] == -np.inf:
                return chosen
            _, c, chosen[c], more, bytes_more = best
            arcs, held = arcs + more, held + bytes_more

    def sets(self, chosen: list[int]) -> DownSets | None:
        """The states of all columns, numbered through; None where too much may follow in one of them."""
        if max(column[t][3] for column, t in zip(self.sizes, chosen, strict=True)) > MOST_FOLLOWING:
            return None
        section = self.section
        paths = [np.flatnonzero(section.column == c).astype(np.int32) for c in range(section.columns)]
        best = [
            with_what_follows(closure, column[t])
            for closure, column, t in zip(self.closures, self.choices, chosen, strict=True)
        ]
        return _joined(section.n, paths, best)

    def together(
        self, chosen: list[int], should_stop: Callable[[], bool] = lambda: False
    ) -> list[NDArray[np.bool_]] | None:
        """Which states of neighbouring columns may go together, see ``counts_together``; None for all."""
        if self.before is None:
            return None
        states = [column[t] for column, t in zip(self.choices, chosen, strict=True)]
        return counts_together(self.section.column, self.before, states, should_stop)

    def _sizes_of(self, chosen: list[int]) -> list[list[int]]:
        return [column[t].tolist() for column, t in zip(self.sizes, chosen, strict=True)]

    def _changes(
        self, of_pair: Callable[[list[int], list[int] | None], int], chosen: list[int]
    ) -> Iterator[tuple[int, int, int]]:
        """What grows by how much where one column has another choice: that, the column, and the choice."""
        now = self._sizes_of(chosen)
        for c, column in enumerate(self.sizes):
            around = now[max(0, c - 1) : c + 2]
            at = c - max(0, c - 1)
            before = _sum(of_pair, around)
            for t, size in enumerate(column):
                if t != chosen[c]:
                    yield _sum(of_pair, [*around[:at], size.tolist(), *around[at + 1 :]]) - before, c, t


def few_down_sets(section: Section, most_arcs: int) -> DownSets | None:
    """All down-sets of each column, where these make so few travels; None where they do not."""
    whole = all_down_sets(section, MOST_DOWN_SETS)
    return whole if whole is not None and extent(whole, pairs_of(section))[1] <= most_arcs else None


def _mean_ends(size: NDArray[np.int64]) -> float:
    """How many toolpaths may have been the last one of a column's state, on average."""
    return float(size[2] / size[0])


def _size(sets: DownSets) -> NDArray[np.int64]:
    """int64 (4,), the states of a column, their steps, their ends, and the sum of steps times ends."""
    steps, ends = np.diff(sets.step_start).astype(np.int64), np.diff(sets.top_start).astype(np.int64)
    return np.array([len(steps), steps.sum(), ends.sum(), (steps * ends).sum()])


def _sum(of_pair: Callable[[list[int], list[int] | None], int], sizes: list[list[int]]) -> int:
    """The sum over pairs of neighbouring columns; of a single column where there is but one."""
    if len(sizes) == 1:
        return of_pair(sizes[0], None)
    return sum(of_pair(a, b) for a, b in pairwise(sizes))


def _arcs(a: list[int], b: list[int] | None) -> int:
    """The travels that the bound over a pair of columns looks at; see ``corridor.extent``."""
    if b is None:
        return 4 * a[3]
    return 4 * (a[3] * b[0] + a[0] * b[3] + a[1] * b[2] + a[2] * b[1])


def _bytes(a: list[int], b: list[int] | None) -> int:
    """What the block of a pair of columns holds, about."""
    if b is None:
        return STATE_BYTES * a[0] + STEP_BYTES * a[1] + END_BYTES * a[2]
    steps, ends = a[1] * b[0] + a[0] * b[1], a[2] * b[0] + a[0] * b[2]
    return STATE_BYTES * a[0] * b[0] + STEP_BYTES * steps + END_BYTES * ends


def _joined(n: int, paths: list[NDArray[np.int32]], parts: list[DownSets]) -> DownSets:
    """The states of all columns, each of which has its own ``paths``, numbered through."""
    local = np.empty(n, np.int32)
    for own in paths:  # whatever the states are, so that multipliers can be carried over
        local[own] = np.arange(len(own))
    start, step_start, top_start, follow_start = (
        np.concatenate([[0], np.cumsum([ends[-1] for ends in of_parts])])
        for of_parts in zip(
            *[(s.start, s.step_start, s.top_start, s.follow_start) for s in parts], strict=True
        )
    )
    return DownSets(
        start.astype(np.int32),
        _through([s.step_start for s in parts], step_start),
        np.concatenate([own[s.step_path] for own, s in zip(paths, parts, strict=True)]),
        np.concatenate([s.step_to + at for s, at in zip(parts, start, strict=False)]).astype(np.int32),
        np.concatenate([s.step_slot for s in parts]),
        _through([s.top_start for s in parts], top_start),
        np.concatenate([own[s.top_path] for own, s in zip(paths, parts, strict=True)]),
        _through([s.follow_start for s in parts], follow_start),
        np.concatenate([s.follows for s in parts]),
        local,
        np.array([len(own) for own in paths], np.int32),
        np.concatenate([s.corridor for s in parts]),
    )


def _through(starts: list[NDArray[np.int32]], base: NDArray[np.int64]) -> NDArray[np.int32]:
    """Where the rows of each part start, counted on through the parts."""
    moved = [own[:-1] + at for own, at in zip(starts, base, strict=False)]
    return np.concatenate([*moved, base[-1:]]).astype(np.int32)
