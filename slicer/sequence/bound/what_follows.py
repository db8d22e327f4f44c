"""What may come next of a column after its last toolpath, where states are counts and do not say it.

See ``DownSets.follows``. A state of a block leaves out some steps of its columns' down-sets, so that what may
follow has to be found among its own. Such blocks have one column or two.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import NONE, OUTSIDE, Blocks


@inner_kernel
def is_counted(block_costs: BlockCosts) -> bool:
    """Whether states are counts."""
    return bool(block_costs.visits < block_costs.visits_end)


@inner_kernel
def most_steps(blocks: Blocks) -> int:
    """The most steps that a state has, or the down-set of a column."""
    most = 0
    for d in range(blocks.down_sets):
        most = max(most, blocks.follows.step_start[d + 1] - blocks.follows.step_start[d])
    for s in range(len(blocks.dense)):
        most = max(most, blocks.move_start[s + 1] - blocks.move_start[s])
    return most


@inner_kernel
def find_steps(blocks: Blocks, k: int, s: int, place: NDArray[np.int64]) -> None:
    """Fill ``place`` (2, m): which step of state s of block k each step of its first and of its last column's
    down-set is, or ``NONE``."""
    move, end = blocks.move_start[s], blocks.move_start[s + 1]
    for side in range(2 if blocks.bounds[k + 1] > blocks.bounds[k] else 1):
        before = blocks.column_size[blocks.bounds[k]] if side else 0
        down_set = blocks.end_set[s, side]
        first = blocks.follows.step_start[down_set]
        # They are in the same order.
        for step in range(first, blocks.follows.step_start[down_set + 1]):
            place[side, step - first] = NONE
            if move < end and blocks.move_path[move] == before + blocks.follows.step_path[step]:
                place[side, step - first] = move - blocks.move_start[s]
                move += 1


@inner_kernel
def find_top(blocks: Blocks, s: int, x: int, side: int) -> tuple[int, int]:
    """The toolpath of value x of state s as a maximal element of the first or the last column's down-set, and
    that down-set."""
    tops, down_set = blocks.follows.top_start, blocks.end_set[s, side]
    before = 0
    if side == 1:
        left = blocks.end_set[s, 0]
        before = tops[left + 1] - tops[left]
    return tops[down_set] + (x - blocks.value_start[s] - OUTSIDE) // 2 - before, down_set


@inner_kernel
def may_follow(blocks: Blocks, top: int, down_set: int, path: int) -> bool:
    """Whether a toolpath of its column may come next after a maximal element of a down-set."""
    follows = blocks.follows
    for q in range(follows.start[top], follows.start[top + 1]):
        if follows.step_path[follows.step_start[down_set] + follows.steps[q]] == path:
            return True
    return False
