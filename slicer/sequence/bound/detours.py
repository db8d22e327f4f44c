"""What travels cost beyond direct ones, because of what is printed at a state of a block.

A state says what is printed of each of its columns, so what a travel between two of them costs that keeps
above it is known. The block that pays for the travel pays that too; of a travel inside a seam column, which
two blocks see alike, each pays half. What stands outside of the block is not known, and may be in the way of
a nozzle's body: such a travel is priced as direct.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel, kernel
from slicer.sequence.bound.pair_costs import BlockCosts, column_of, no_detours
from slicer.sequence.problem import CostModel
from slicer.sequence.states import (
    FREE,
    NONE,
    OUTSIDE,
    Blocks,
    DownSets,
    Section,
    Skylines,
    cost_over,
    least_over_certain,
    sets_of_states,
)

MOST = 100_000_000
"""Detours that are kept, at four bytes each; with more of them travels are priced as direct."""
ROUNDING = 1.0 - 1e-6
"""Single precision must not round a bound up."""


class Travels(NamedTuple):
    """What travels are between, what they cost, and up to which cost it is worth to know their detours."""

    segments: NDArray[np.float64]
    cost_model: CostModel
    most: float


class Measured(NamedTuple):
    """Whose detours are measured: which states', bool (s,), and what a travel costs directly at most."""

    states: NDArray[np.bool_]
    most: float


def measure_detours(
    section: Section,
    sets: DownSets,
    blocks: Blocks,
    block_costs: BlockCosts,
    sky: Skylines,
    measured: Measured,
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """``detour_start`` and ``detour`` of ``BlockCosts``: for each end of a state two for each step."""
    start = _rows(blocks, measured.states)
    if start[0] > MOST:
        return no_detours(blocks)
    detour = np.empty(start[0], np.float32)
    travels = Travels(section.segments, section.cost_model, measured.most)
    _fill(blocks, block_costs, travels, sky, sets_of_states(blocks, sets), start, detour)
    return start, detour


def raise_over_certain(section: Section, blocks: Blocks, block_costs: BlockCosts) -> None:
    """Raise the direct costs of travels over what surely stands, see ``least_over_certain``."""
    pairs, cost = least_over_certain(section, blocks.home[section.column])
    if len(pairs) == 0:
        return
    local = np.empty(section.n, np.int64)
    for k in range(blocks.blocks):
        low, high = int(blocks.path_start[k]), int(blocks.path_start[k + 1])
        local[:] = NONE
        local[blocks.path[low:high]] = np.arange(high - low)
        own = (local[pairs >> 1] != NONE).all(axis=1)
        start, end = (2 * local[pairs[own] >> 1] + (pairs[own] & 1)).T
        stride = 2 * (high - low)
        direct = block_costs.direct[block_costs.arc_start[k] :]
        direct[start * stride + end] = np.maximum(direct[start * stride + end], cost[own])


def still_there(
    before: Blocks, block_costs: BlockCosts, blocks: Blocks
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The detours of those states, ends and steps that are left of ``before``."""
    if len(block_costs.detour) == 0:
        return no_detours(blocks)
    kept = np.diff(block_costs.detour_start) != 0
    measured = np.empty(len(blocks.dense), np.bool_)
    for k in range(blocks.blocks):
        old = slice(before.state_start[k], before.state_start[k + 1])
        states = slice(blocks.state_start[k], blocks.state_start[k + 1])
        measured[states] = kept[old][np.searchsorted(before.dense[old], blocks.dense[states])]
    start = _rows(blocks, measured)
    detour = np.empty(start[0], np.float32)
    _copy(before, block_costs, blocks, start, detour)
    return start, detour


def _rows(blocks: Blocks, measured: NDArray[np.bool_]) -> NDArray[np.int64]:
    """``detour_start`` of ``BlockCosts``; states that are not measured have none."""
    ends = np.diff(blocks.value_start).astype(np.int64) - OUTSIDE
    size = 2 * ends * np.diff(blocks.move_start) * measured
    return np.concatenate([np.cumsum(size[::-1])[::-1], [0]])


@kernel
def _fill(
    blocks: Blocks,
    block_costs: BlockCosts,
    travels: Travels,
    sky: Skylines,
    state_sets: tuple[NDArray[np.int64], NDArray[np.int32]],
    start: NDArray[np.int64],
    detour: NDArray[np.float32],
) -> None:
    segments, cost_model, most = travels
    first_set, set_of = state_sets
    printed = np.empty(len(blocks.column_size), np.int32)
    for k in range(len(blocks.state_start) - 1):
        low, left, right = blocks.path_start[k], blocks.bounds[k], blocks.bounds[k + 1]
        stride, width = 2 * (blocks.path_start[k + 1] - low), right - left + 1
        for s in range(blocks.state_start[k], blocks.state_start[k + 1]):
            if start[s + 1] == start[s]:
                continue
            for q in range(width):
                printed[left + q] = set_of[first_set[k] + (s - blocks.state_start[k]) * width + q]
            at = start[s + 1]
            for x in range(blocks.value_start[s] + OUTSIDE, blocks.value_start[s + 1]):
                u = blocks.value_path[x]
                path, u_column = blocks.path[low + (u >> 1)], column_of(blocks, k, u)[0]
                row = block_costs.arc_start[k] + u * stride
                for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                    to = blocks.path[low + blocks.move_path[m]]
                    v_column = column_of(blocks, k, 2 * blocks.move_path[m])[0]
                    known = _is_known(sky, (u_column, v_column), (left, right))
                    shared = u_column == v_column and _is_seam(block_costs, u_column)
                    for f in range(2):
                        extra = 0.0
                        direct = block_costs.direct[row + 2 * blocks.move_path[m] + f]
                        if known and direct <= most:
                            cost = cost_over(
                                cost_model,
                                sky,
                                printed,
                                (u_column, v_column),
                                (path, segments[path]),
                                (segments[path, 1 - (u & 1), 0], segments[path, 1 - (u & 1), 1]),
                                (segments[to, f, 0], segments[to, f, 1]),
                            )
                            if cost != FREE:
                                extra = cost - direct
                        detour[at] = max(0.0, extra) * (0.5 if shared else 1.0) * ROUNDING
                        at += 1


@inner_kernel
def _is_known(sky: Skylines, columns: tuple[int, int], block: tuple[int, int]) -> bool:
    """Whether all that may be in the way of a travel between two columns stands in a block's."""
    if sky.body.half_width == 0.0:
        return True
    first, last = min(columns[0], columns[1]), max(columns[0], columns[1])
    return bool(sky.reaching[first, 0] >= block[0] and sky.reaching[last, 1] <= block[1])


@inner_kernel
def _is_seam(block_costs: BlockCosts, column: int) -> bool:
    return bool(block_costs.pair_start[column + 1] > block_costs.pair_start[column])


@bare_kernel
def _copy(
    before: Blocks,
    block_costs: BlockCosts,
    blocks: Blocks,
    start: NDArray[np.int64],
    detour: NDArray[np.float32],
) -> None:
    """Fill in the detours of what is left; states, ends and steps keep their order."""
    for k in range(len(blocks.state_start) - 1):
        old = before.state_start[k]
        for s in range(blocks.state_start[k], blocks.state_start[k + 1]):
            if start[s + 1] == start[s]:
                continue
            while before.dense[old] != blocks.dense[s]:
                old += 1
            old_first = before.move_start[old]
            old_steps = before.move_start[old + 1] - old_first
            at, old_x = start[s + 1], before.value_start[old] + OUTSIDE
            for x in range(blocks.value_start[s] + OUTSIDE, blocks.value_start[s + 1]):
                while before.value_path[old_x] != blocks.value_path[x]:
                    old_x += 1
                row = block_costs.detour_start[old + 1] + 2 * old_steps * (
                    old_x - before.value_start[old] - OUTSIDE
                )
                old_m = old_first
                for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                    while before.move_path[old_m] != blocks.move_path[m]:
                        old_m += 1
                    for f in range(2):
                        detour[at] = block_costs.detour[row + 2 * (old_m - old_first) + f]
                        at += 1
