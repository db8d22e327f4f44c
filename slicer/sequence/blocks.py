"""Blocks of neighbouring columns: all that can be printed of a block, and how it goes on from there.

A sheet is covered by blocks of columns that overlap in one column each: columns 0-1, 1-2, 2-3 and so on, or
0-2, 2-4. A state of a block is one down-set of each of its columns. Its graph is small enough to be held
as a whole where that of the sheet never is.
"""

from itertools import pairwise
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.downsets import DownSets
from slicer.sequence.section import NONE, Section

OUTSIDE = 2
"""Values of a state before those of its maximal elements: the nozzle is left, or right, of the block."""


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
        dense: int64 (s,), the row-major number of each state among the tuples of down-sets.
        home: int32 (c, 2), the first and the last block that has a column.
        column_size: int32 (c,), the number of toolpaths of each column.
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
    dense: NDArray[np.int64]
    home: NDArray[np.int32]
    column_size: NDArray[np.int32]

    @property
    def blocks(self) -> int:
        """The number of blocks."""
        return len(self.state_start) - 1

    @property
    def arcs(self) -> int:
        """The travels that one evaluation looks at: from each end of a state to each of its next entries."""
        ends = np.diff(self.value_start).astype(np.int64) - OUTSIDE
        return int(2 * (ends * np.diff(self.move_start)).sum())

    def shape(self, k: int, sets: DownSets) -> tuple[int, ...]:
        """The numbers of down-sets of the columns of block k."""
        return tuple(int(d) for d in sets.count[self.bounds[k] : self.bounds[k + 1] + 1])

    def alive(self, k: int, sets: DownSets) -> NDArray[np.bool_]:
        """bool, shape ``shape(k)``: which tuples of down-sets are states of block k."""
        out = np.zeros(self.shape(k, sets), np.bool_)
        out.flat[self.dense[self.state_start[k] : self.state_start[k + 1]]] = True
        return out


def cover(sets: DownSets, most_states: int = 0) -> NDArray[np.int32]:
    """int32 (b + 1,), the ``bounds`` of blocks of two columns, or of more where those have few states.

    Args:
        sets: the down-sets of the columns.
        most_states: a block of three columns and more has at most so many.
    """
    count = [int(d) for d in sets.count]
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
    allowed: list[NDArray[np.bool_]] | None = None,
) -> Blocks:
    """Build the state graphs, of what can be reached from nothing and can still be completed.

    Args:
        section: what is ordered.
        sets: its down-sets.
        bounds: see ``Blocks``.
        allowed: for each block, bool of the shape of its down-sets: which states may be there.
    """
    count = sets.count
    shapes = [tuple(count[a : b + 1]) for a, b in pairwise(bounds)]
    dense_start = np.concatenate([[0], np.cumsum([int(np.prod(s)) for s in shapes])]).astype(np.int64)
    alive = np.ones(dense_start[-1], np.bool_)
    if allowed is not None:
        alive = np.concatenate([a.ravel() for a in allowed])
    last = section.last >> 1 if section.last != NONE else NONE
    ends = np.array([section.column[s] if s != NONE else NONE for s in (section.first, last)], np.int32)
    _prune_unreachable(bounds, dense_start, alive, sets.start, sets.step_start, sets.step_to, ends)
    order = np.lexsort((sets.local, section.column))
    column_start = np.concatenate([[0], np.cumsum(sets.size)])
    members = [order[column_start[a] : column_start[b + 1]] for a, b in pairwise(bounds)]
    path_start = np.concatenate([[0], np.cumsum([len(m) for m in members])]).astype(np.int32)
    state_start, number, move_start, value_start, dense = _number(
        bounds, dense_start, alive, sets.start, sets.step_start, sets.step_to, sets.top_start
    )
    move_path, move_to, move_value, value_path = _fill(
        bounds,
        dense_start,
        number,
        state_start,
        move_start,
        value_start,
        dense,
        sets.start,
        sets.step_start,
        np.stack([sets.step_path, sets.step_to, sets.step_slot]),
        sets.top_start,
        sets.top_path,
        sets.local,
        sets.size,
    )
    columns = np.arange(section.columns)
    inner = np.searchsorted(bounds, columns, side="left")
    home = np.stack([np.maximum(inner - 1, 0), np.searchsorted(bounds, columns, side="right") - 1], axis=1)
    return Blocks(
        bounds,
        path_start,
        np.concatenate(members).astype(np.int32),
        state_start,
        move_start,
        move_path,
        move_to,
        move_value,
        value_start,
        value_path,
        dense,
        np.minimum(home, len(bounds) - 2).astype(np.int32),
        sets.size,
    )


@kernel
def _strides(bounds: NDArray[np.int32], set_start: NDArray[np.int32], k: int) -> NDArray[np.int64]:
    """int64 (columns of block k,): what one step of each column adds to the row-major number."""
    width = bounds[k + 1] - bounds[k] + 1
    stride = np.ones(width, np.int64)
    for q in range(width - 1, 0, -1):
        stride[q - 1] = stride[q] * (set_start[bounds[k] + q + 1] - set_start[bounds[k] + q])
    return stride


@kernel
def _prune_unreachable(
    bounds: NDArray[np.int32],
    dense_start: NDArray[np.int64],
    alive: NDArray[np.bool_],
    set_start: NDArray[np.int32],
    step_start: NDArray[np.int32],
    step_to: NDArray[np.int32],
    ends: NDArray[np.int32],
) -> None:
    """Clear ``alive`` where a state is not on any way from nothing to everything.

    Where the first toolpath is fixed, its column (``ends[0]``) cannot be empty when others of the block
    are not; where the last one is, its column (``ends[1]``) cannot be complete when others are not.
    """
    for k in range(len(bounds) - 1):
        base, size = dense_start[k], dense_start[k + 1] - dense_start[k]
        stride = _strides(bounds, set_start, k)
        reached = np.zeros(size, np.bool_)
        reached[0] = True
        for forward in (True, False):
            for place in range(size):
                index = place if forward else size - 1 - place
                if not alive[base + index] or (forward and not reached[index]):
                    alive[base + index] = False
                    continue
                rest = index
                lives = forward or index == size - 1
                for q in range(len(stride)):
                    c = bounds[k] + q
                    at = set_start[c] + rest // stride[q]
                    rest %= stride[q]
                    if (c == ends[0] and at == set_start[c] and index > 0) or (
                        c == ends[1] and at == set_start[c + 1] - 1 and index < size - 1
                    ):
                        lives = False
                        break
                    for e in range(step_start[at], step_start[at + 1]):
                        to = index + (step_to[e] - at) * stride[q]
                        if forward:
                            reached[to] = True
                        else:
                            lives |= alive[base + to]
                alive[base + index] = lives


@kernel
def _number(
    bounds: NDArray[np.int32],
    dense_start: NDArray[np.int64],
    alive: NDArray[np.bool_],
    set_start: NDArray[np.int32],
    step_start: NDArray[np.int32],
    step_to: NDArray[np.int32],
    top_start: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
    """Number the living states: state_start, number by row-major place, move_start, value_start, dense."""
    states = np.count_nonzero(alive)
    state_start = np.zeros(len(bounds), np.int32)
    number = np.full(len(alive), NONE, np.int32)
    move_start = np.zeros(states + 1, np.int32)
    value_start = np.zeros(states + 1, np.int32)
    dense = np.empty(states, np.int64)
    s = 0
    for k in range(len(bounds) - 1):
        stride = _strides(bounds, set_start, k)
        for index in range(dense_start[k + 1] - dense_start[k]):
            if not alive[dense_start[k] + index]:
                continue
            number[dense_start[k] + index] = s
            dense[s] = index
            values, moves, rest = OUTSIDE, 0, index
            for q in range(len(stride)):
                at = set_start[bounds[k] + q] + rest // stride[q]
                rest %= stride[q]
                values += 2 * (top_start[at + 1] - top_start[at])
                for e in range(step_start[at], step_start[at + 1]):
                    moves += alive[dense_start[k] + index + (step_to[e] - at) * stride[q]]
            move_start[s + 1] = move_start[s] + moves
            value_start[s + 1] = value_start[s] + values
            s += 1
        state_start[k + 1] = s
    return state_start, number, move_start, value_start, dense


@kernel
def _fill(
    bounds: NDArray[np.int32],
    dense_start: NDArray[np.int64],
    number: NDArray[np.int32],
    state_start: NDArray[np.int32],
    move_start: NDArray[np.int32],
    value_start: NDArray[np.int32],
    dense: NDArray[np.int64],
    set_start: NDArray[np.int32],
    step_start: NDArray[np.int32],
    step: NDArray[np.int32],
    top_start: NDArray[np.int32],
    top_path: NDArray[np.int32],
    local: NDArray[np.int32],
    size: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """The steps and values of all states: move_path, move_to, move_value, value_path; see ``Blocks``."""
    move_path = np.empty(move_start[-1], np.int32)
    move_to = np.empty(move_start[-1], np.int32)
    move_value = np.empty(move_start[-1], np.int32)
    value_path = np.full(value_start[-1], NONE, np.int32)
    for k in range(len(bounds) - 1):
        stride = _strides(bounds, set_start, k)
        for s in range(state_start[k], state_start[k + 1]):
            m, offset, rest = move_start[s], 0, dense[s]
            tops = OUTSIDE  # a step in one column leaves the values of the columns left of it in place
            for q in range(len(stride)):
                at = set_start[bounds[k] + q] + rest // stride[q]
                rest %= stride[q]
                for e in range(step_start[at], step_start[at + 1]):
                    to = number[dense_start[k] + dense[s] + (step[1, e] - at) * stride[q]]
                    if to != NONE:
                        move_path[m] = offset + local[step[0, e]]
                        move_to[m] = to
                        move_value[m] = value_start[to] + tops + 2 * step[2, e]
                        m += 1
                for t in range(top_start[at], top_start[at + 1]):
                    for f in range(2):
                        value_path[value_start[s] + tops] = 2 * (offset + local[top_path[t]]) + f
                        tops += 1
                offset += size[bounds[k] + q]
    return move_path, move_to, move_value, value_path
