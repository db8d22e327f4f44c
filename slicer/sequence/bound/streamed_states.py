"""Which down-sets of two neighbouring columns are looked at together, and where their values are.

All of them for a bound. Good sequences print neighbours at about the same pace, so that prices, and a beam
search, come out the same where only those are looked at whose columns are about equally done.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states import DownSets


class PairStates(NamedTuple):
    """The states of two neighbouring columns, down-sets i of the left one and j of the right one.

    Attributes:
        low, high: int32 (a,); i goes with j from low[i] to high[i] - 1.
        outside: int64 (a,), the values of state (i, j) outside the pair are outside[i] + 2j, left of it, and
            the next, right of it.
        left: int64 (a,), that of its oriented maximal element p of i is left[i] + j + p (high[i] - low[i]).
        right: int64 (a,), that of the maximal element t of j, counted through the right column's, twice each,
            is right[i] + t.
        size: int64 (3,), how many values there are of each.
    """

    low: NDArray[np.int32]
    high: NDArray[np.int32]
    outside: NDArray[np.int64]
    left: NDArray[np.int64]
    right: NDArray[np.int64]
    size: NDArray[np.int64]


def pair_states(sets: DownSets, sizes: list[NDArray[np.int64]], c: int, slack: float) -> PairStates:
    """The states of columns c and c + 1.

    Args:
        sets: the down-sets.
        sizes: how many toolpaths each holds, by columns, see ``set_sizes``.
        c: the left column.
        slack: how far apart the columns may be done, as a part of them; 1 or more for all states.
    """
    share, done = sizes[c] / sizes[c][-1], sizes[c + 1] / sizes[c + 1][-1]
    low = np.searchsorted(done, share - slack).astype(np.int32)
    high = np.searchsorted(done, share + slack, side="right").astype(np.int32)
    width = (high - low).astype(np.int64)
    top = 2 * sets.top_start[sets.start[c + 1] : sets.start[c + 2] + 1].astype(np.int64)
    top -= top[0]
    tops = 2 * np.diff(sets.top_start[sets.start[c] : sets.start[c + 1] + 1])
    values = np.stack([2 * width, tops * width, top[high] - top[low]])
    end = np.cumsum(values, axis=1)
    begin = end - values
    return PairStates(low, high, begin[0] - 2 * low, begin[1] - low, begin[2] - top[low], end[:, -1].copy())


class StateValues(NamedTuple):
    """The values of all pairs of columns at once, to guide a search.

    Attributes:
        states: as of one pair, with the down-sets numbered through all columns but the last.
        outside, left, right: float32, see ``streamed_dp.Values``.
    """

    states: PairStates
    outside: NDArray[np.float32]
    left: NDArray[np.float32]
    right: NDArray[np.float32]


def room_for(pairs: list[PairStates]) -> StateValues:
    """Room for the values of pairs, yet to be filled in."""
    size = np.array([states.size for states in pairs])
    begin = np.cumsum(size, axis=0) - size
    shifted = [
        np.concatenate([part[k] + begin[c, k - 2] for c, part in enumerate(pairs)]) for k in range(2, 5)
    ]
    states = PairStates(
        np.concatenate([part.low for part in pairs]),
        np.concatenate([part.high for part in pairs]),
        shifted[0],
        shifted[1],
        shifted[2],
        size.sum(axis=0),
    )
    return StateValues(states, *(np.empty(count, np.float32) for count in states.size))
