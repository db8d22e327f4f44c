"""Blocks of neighbouring columns: all that can be printed of a block, and how it goes on from there.

A sheet is covered by blocks of columns that overlap in one column each: columns 0-1, 1-2, 2-3 and so on, or
0-2, 2-4. A state of a block is one down-set of each of its columns, such as go together. Its graph is small
enough to be held as a whole where that of the sheet never is.
"""

from itertools import pairwise
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.block_states import OUTSIDE, fill_states, number_states, prune_unreachable
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import NONE, Section

__all__ = ["OUTSIDE", "Blocks", "connect", "cover"]


class Follows(NamedTuple):
    """What may come next of a column, see ``DownSets``.

    Attributes:
        step_start, step_path: int32, the steps of each down-set, as toolpaths of their column.
        top_start: int32, where its maximal elements begin.
        start, steps: int32, for each of those which steps may follow.
    """

    step_start: NDArray[np.int32]
    step_path: NDArray[np.int32]
    top_start: NDArray[np.int32]
    start: NDArray[np.int32]
    steps: NDArray[np.int32]


class Blocks(NamedTuple):
    """The state graphs of all blocks, one after the other; every step leads to a higher number.

    Each state has *values*, numbered through as well: the nozzle left of the block, right of it, and at
    the end of each maximal element of the state in either direction.

    Attributes:
        bounds: int32 (b + 1,); block k has the columns bounds[k] .. bounds[k + 1], both included.
        path_start, path: int32, the toolpaths of each block; a block numbers its own from 0.
        state_start: int32 (b + 1,), the states of each block, from nothing printed to everything.
        move_start: int32 (s + 1,), the steps from each state.
        move_path, move_to, move_value: int32, the toolpath of a step (in its block's numbers), the state
            it leads to, and the value there for its direction 0; that for direction 1 is the next.
        value_start: int32 (s + 1,), the values of each state.
        value_path: int32, the oriented toolpath (in its block's numbers) of each value, or ``NONE``.
        allowed: bool, whether a toolpath may be printed so, by the oriented toolpaths (in blocks' numbers,
            counted on through the blocks).
        dense: int64 (s,), the row-major number of each state among the tuples of down-sets.
        end_set: int32 (s, 2), the down-sets of each state's first and last column, in ``DownSets``' numbers.
        follows: which steps of a down-set may come next of a column, see ``Follows``.
        down_sets: how many there are of all columns.
        home: int32 (c, 2), the first and the last block that has a column.
        column_size: int32 (c,), the number of toolpaths of each column.
        column_start: int32 (c + 1,), the number of those in all columns before each.
    """

    bounds: NDArray[np.int32]
    path_start: NDArray[np.int32]
    path: NDArray[np.int32]
    state_start: NDArray[np.int32]
    move_start: NDArray[np.int32]
    move_path: NDArray[np.int32]
    move_to: NDArray[np.int32]
    move_value: NDArray[np.int32]
    value_start: NDArray[np.int32]
    value_path: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    dense: NDArray[np.int64]
    end_set: NDArray[np.int32]
    follows: Follows
    down_sets: int
    home: NDArray[np.int32]
    column_size: NDArray[np.int32]
    column_start: NDArray[np.int32]

    @property
    def blocks(self) -> int:
        """The number of blocks."""
        return len(self.state_start) - 1

    @property
    def arcs(self) -> int:
        """The travels that one evaluation looks at."""
        return int(self.arcs_at.sum())

    @property
    def arcs_at(self) -> NDArray[np.int64]:
        """int64 (s,), those of each state: from each of its ends to each of its next entries."""
        ends = np.diff(self.value_start).astype(np.int64) - OUTSIDE
        return 2 * ends * np.diff(self.move_start)

    def shape(self, k: int, sets: DownSets) -> tuple[int, ...]:
        """The numbers of down-sets of the columns of block k."""
        return tuple(int(d) for d in sets.counts[self.bounds[k] : self.bounds[k + 1] + 1])

    def among(self, chosen: NDArray[np.bool_], sets: DownSets) -> list[NDArray[np.bool_]]:
        """For each block k, bool of ``shape(k)``: the tuples of down-sets of states chosen, bool (s,)."""
        out = []
        for k in range(self.blocks):
            states = slice(self.state_start[k], self.state_start[k + 1])
            mask = np.zeros(self.shape(k, sets), np.bool_)
            mask.flat[self.dense[states][chosen[states]]] = True
            out.append(mask)
        return out


def cover(sets: DownSets, most_states: int = 0) -> NDArray[np.int32]:
    """int32 (b + 1,), the ``bounds`` of blocks of two columns, or of more where those have few states.

    Args:
        sets: the down-sets of the columns.
        most_states: a block of three columns and more has at most so many.
    """
    count = [int(d) for d in sets.counts]
    bounds = [0]
    while bounds[-1] < len(count) - 1 or len(bounds) < 2:
        end = min(bounds[-1] + 1, len(count) - 1)
        states = prod(count[bounds[-1] : end + 1])
        while end + 1 < len(count) and states * count[end + 1] <= most_states:
            end += 1
            states *= count[end]
        bounds.append(end)
    return np.array(bounds, np.int32)


def connect(
    section: Section,
    sets: DownSets,
    bounds: NDArray[np.int32],
    among: list[NDArray[np.bool_]] | None = None,
) -> Blocks:
    """Build the state graphs, of what can be reached from nothing and can still be completed.

    Args:
        section: what is ordered.
        sets: its down-sets.
        bounds: see ``Blocks``.
        among: for each block, bool of the shape of its down-sets: which states may be there; None for all.
    """
    count = sets.counts
    shapes = [tuple(count[a : b + 1]) for a, b in pairwise(bounds)]
    dense_start = np.concatenate([[0], np.cumsum([int(np.prod(s)) for s in shapes])]).astype(np.int64)
    alive = np.ones(dense_start[-1], np.bool_)
    if among is not None:
        alive = np.concatenate([a.ravel() for a in among])
    last = section.last >> 1 if section.last != NONE else NONE
    ends = np.array([section.column[s] if s != NONE else NONE for s in (section.first, last)], np.int32)
    prune_unreachable(bounds, dense_start, alive, sets.start, sets.step_start, sets.step_to, ends)
    order = np.lexsort((sets.local, section.column))
    column_start = np.concatenate([[0], np.cumsum(sets.size)]).astype(np.int32)
    members = [order[column_start[a] : column_start[b + 1]] for a, b in pairwise(bounds)]
    path_start = np.concatenate([[0], np.cumsum([len(m) for m in members])]).astype(np.int32)
    path = np.concatenate(members).astype(np.int32)
    numbers = number_states(
        bounds, dense_start, alive, sets.start, sets.step_start, sets.step_to, sets.top_start
    )
    move_path, move_to, move_value, value_path = fill_states(bounds, dense_start, numbers, sets)
    columns = np.arange(section.columns)
    inner = np.searchsorted(bounds, columns, side="left")
    home = np.stack([np.maximum(inner - 1, 0), np.searchsorted(bounds, columns, side="right") - 1], axis=1)
    return Blocks(
        bounds,
        path_start,
        path,
        numbers.state_start,
        numbers.move_start,
        move_path,
        move_to,
        move_value,
        numbers.value_start,
        value_path,
        section.allowed[path].ravel(),
        numbers.dense,
        _end_sets(sets, bounds, numbers.state_start, numbers.dense),
        Follows(sets.step_start, sets.local[sets.step_path], sets.top_start, sets.follow_start, sets.follows),
        int(sets.start[-1]),
        np.minimum(home, len(bounds) - 2).astype(np.int32),
        sets.size,
        column_start,
    )


def _end_sets(
    sets: DownSets, bounds: NDArray[np.int32], state_start: NDArray[np.int32], dense: NDArray[np.int64]
) -> NDArray[np.int32]:
    """``end_set`` of ``Blocks``."""
    out = np.empty((len(dense), 2), np.int32)
    for k, (a, b) in enumerate(pairwise(bounds)):
        states = slice(state_start[k], state_start[k + 1])
        behind = prod(int(d) for d in sets.counts[a + 1 : b + 1])
        out[states, 0] = sets.start[a] + dense[states] // behind
        out[states, 1] = sets.start[b] + dense[states] % sets.counts[b]
    return out
