"""Where the walks through all blocks begin and end."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states import NONE, Blocks, DownSets, Section


class Ends(NamedTuple):
    """Where the walks of all blocks begin and end.

    Attributes:
        starts: int32 (k,), the oriented toolpaths to begin with, as far as the blocks have them.
        start_value: int32 (k, 2), for each of them, its value in the first and the last
            block that has its column.
        start_home: int32 (k, 2), those blocks.
        last_home: int32 (2,), the first and last block of the last toolpath; (NONE, NONE) for a free end.
        last_local: int32 (2,), the last oriented toolpath in the numbers of those blocks.
    """

    starts: NDArray[np.int32]
    start_value: NDArray[np.int32]
    start_home: NDArray[np.int32]
    last_home: NDArray[np.int32]
    last_local: NDArray[np.int32]


def find_ends(section: Section, sets: DownSets, blocks: Blocks) -> Ends:
    """Find the values of all starts, and the last toolpath in the numbers of its blocks."""
    starts, values = [], []
    for u in section.starts:
        home = blocks.home[section.column[u >> 1]]
        at = [_first_step(section, sets, blocks, int(k), int(u) >> 1) for k in home]
        if NONE not in at:
            starts.append(u)
            values.append([blocks.move_value[e] + (u & 1) for e in at])
    last_home = np.full(2, NONE, np.int32)
    last_local = np.full(2, NONE, np.int32)
    if section.last != NONE:
        s = section.last >> 1
        last_home[:] = blocks.home[section.column[s]]
        for end in range(2):
            last_local[end] = 2 * _local(section, sets, blocks, int(last_home[end]), s) + (section.last & 1)
    return Ends(
        np.array(starts, np.int32),
        np.array(values, np.int32),
        blocks.home[section.column[np.array(starts, np.int32) >> 1]],
        last_home,
        last_local,
    )


def _first_step(section: Section, sets: DownSets, blocks: Blocks, k: int, s: int) -> int:
    """The step of block k from nothing to toolpath s, or ``NONE``."""
    empty = blocks.state_start[k]
    begin, end = blocks.move_start[empty], blocks.move_start[empty + 1]
    at = np.flatnonzero(blocks.move_path[begin:end] == _local(section, sets, blocks, k, s))
    return int(begin + at[0]) if len(at) else NONE


def _local(section: Section, sets: DownSets, blocks: Blocks, k: int, s: int) -> int:
    """The number of toolpath s in block k."""
    return int(sets.local[s] + sets.size[blocks.bounds[k] : section.column[s]].sum())
