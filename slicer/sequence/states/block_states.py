"""The states of blocks of columns, as kernels on flat arrays: their numbers, steps and values.

See ``blocks.Blocks`` for what the arrays mean.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, kernel
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import NONE

OUTSIDE = 2
"""Values of a state before those of its maximal elements: the nozzle is left, or right, of the block."""


class Numbers(NamedTuple):
    """The numbers of the living states, as in ``Blocks``; ``number`` is by row-major place, or ``NONE``."""

    state_start: NDArray[np.int32]
    number: NDArray[np.int32]
    move_start: NDArray[np.int32]
    value_start: NDArray[np.int32]
    dense: NDArray[np.int64]


@allocating_inner_kernel
def _strides(bounds: NDArray[np.int32], set_start: NDArray[np.int32], k: int) -> NDArray[np.int64]:
    """int64 (columns of block k,): what one step of each column adds to the row-major number."""
    width = bounds[k + 1] - bounds[k] + 1
    stride = np.empty(width, np.int64)
    stride[width - 1] = 1
    for q in range(width - 1, 0, -1):
        stride[q - 1] = stride[q] * (set_start[bounds[k] + q + 1] - set_start[bounds[k] + q])
    return stride


@kernel
def prune_unreachable(
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
        reached = np.empty(size, np.bool_)
        for index in range(size):
            reached[index] = index == 0
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
def number_states(
    bounds: NDArray[np.int32],
    dense_start: NDArray[np.int64],
    alive: NDArray[np.bool_],
    set_start: NDArray[np.int32],
    step_start: NDArray[np.int32],
    step_to: NDArray[np.int32],
    top_start: NDArray[np.int32],
) -> Numbers:
    """Number the living states."""
    states = 0
    for index in range(len(alive)):
        states += alive[index]
    state_start = np.empty(len(bounds), np.int32)
    number = np.empty(len(alive), np.int32)
    move_start = np.empty(states + 1, np.int32)
    value_start = np.empty(states + 1, np.int32)
    dense = np.empty(states, np.int64)
    s = 0
    state_start[0] = move_start[0] = value_start[0] = 0
    for k in range(len(bounds) - 1):
        stride = _strides(bounds, set_start, k)
        for index in range(dense_start[k + 1] - dense_start[k]):
            number[dense_start[k] + index] = NONE
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
    return Numbers(state_start, number, move_start, value_start, dense)


@kernel
def fill_states(
    bounds: NDArray[np.int32], dense_start: NDArray[np.int64], numbers: Numbers, sets: DownSets
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """The steps and values of all states: move_path, move_to, move_value, value_path; see ``Blocks``."""
    state_start, number, move_start, value_start, dense = numbers
    set_start, step_start, top_start, top_path = sets.start, sets.step_start, sets.top_start, sets.top_path
    step_path, step_to, step_slot, local, size = (
        sets.step_path,
        sets.step_to,
        sets.step_slot,
        sets.local,
        sets.size,
    )
    move_path = np.empty(move_start[-1], np.int32)
    move_to = np.empty(move_start[-1], np.int32)
    move_value = np.empty(move_start[-1], np.int32)
    value_path = np.empty(value_start[-1], np.int32)
    for k in range(len(bounds) - 1):
        stride = _strides(bounds, set_start, k)
        for s in range(state_start[k], state_start[k + 1]):
            m, offset, rest = move_start[s], 0, dense[s]
            for side in range(OUTSIDE):
                value_path[value_start[s] + side] = NONE
            tops = OUTSIDE  # a step in one column leaves the values of the columns left of it in place
            for q in range(len(stride)):
                at = set_start[bounds[k] + q] + rest // stride[q]
                rest %= stride[q]
                for e in range(step_start[at], step_start[at + 1]):
                    to = number[dense_start[k] + dense[s] + (step_to[e] - at) * stride[q]]
                    if to != NONE:
                        move_path[m] = offset + local[step_path[e]]
                        move_to[m] = to
                        move_value[m] = value_start[to] + tops + 2 * step_slot[e]
                        m += 1
                for t in range(top_start[at], top_start[at + 1]):
                    for f in range(2):
                        value_path[value_start[s] + tops] = 2 * (offset + local[top_path[t]]) + f
                        tops += 1
                offset += size[bounds[k] + q]
    return move_path, move_to, move_value, value_path
