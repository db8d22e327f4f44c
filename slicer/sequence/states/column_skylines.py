"""The skyline over each down-set of a column.

Where a travel has to go depends on what is printed: on the down-set of each column that it passes. So the
skylines are made once for all down-sets, and a search that knows the down-sets knows every travel.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.sequence.states.blocks import Blocks
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import Section
from slicer.taut_string import EPS_MM

MOST_PIECES = 64
"""Room for pieces of a skyline at first; it doubles as needed."""


class Skylines(NamedTuple):
    """Skylines as pieces [x left, y left, x right, y right] from left to right; uprights have no width.

    Attributes:
        routed: whether travels keep above what is printed; if not, the rest is empty.
        start: int32 (d + 1,), the pieces of each down-set.
        piece: float64 (p, 4), in mm.
        top: float64 (d,), the greatest height of each down-set's skyline.
        gap_start: int32 (c + 1,), the pieces of what stands between column c - 1 and column c for good.
        gap: float64 (q, 4), in mm.
        hull: float64 (h, 2), scratch for the points of a taut string.
    """

    routed: bool
    start: NDArray[np.int32]
    piece: NDArray[np.float64]
    top: NDArray[np.float64]
    gap_start: NDArray[np.int32]
    gap: NDArray[np.float64]
    hull: NDArray[np.float64]


def skylines(section: Section, sets: DownSets) -> Skylines:
    """The skylines of all down-sets of a section, over what was printed before it."""
    if not section.routed:
        empty = np.empty((0, 4))
        none = np.zeros(1, np.int32)
        return Skylines(False, none, empty, np.empty(0), none, empty, np.empty((0, 2)))
    columns = section.columns
    base, gap_start, gap = _ground(section)
    base_start = np.concatenate([[0], np.cumsum([len(b) for b in base])]).astype(np.int32)
    ground = np.concatenate([*base, np.empty((0, 4))])
    count = int(sets.start[columns])
    start = np.zeros(count + 1, np.int32)
    top = np.full(count, -np.inf)
    room = MOST_PIECES * count + len(ground)
    while True:
        piece = np.empty((room, 4))
        if _raise(
            section.segments,
            sets,
            (base_start, ground),
            np.full(count, -1, np.int32),
            np.full(count, -1, np.int32),
            start,
            piece,
            top,
        ):
            break
        room *= 2
    widest = int(np.diff(start).max()) if count else 0
    return Skylines(
        True,
        start,
        piece[: start[-1]].copy(),
        top,
        gap_start,
        gap,
        np.empty((2 * (widest * columns + len(gap)) + 8, 2)),
    )


def _ground(section: Section) -> tuple[list[NDArray[np.float64]], NDArray[np.int32], NDArray[np.float64]]:
    """Split what was printed before: the pieces in each column, and those in the gaps before each."""
    columns = section.columns
    middle = 0.5 * (section.ground[:, 0] + section.ground[:, 2])
    left, right = section.extent.T
    after = np.searchsorted(left, middle, side="right")  # columns that begin left of the piece
    inside = (after > 0) & (middle <= right[np.maximum(after - 1, 0)])
    base = [section.ground[inside & (after == c + 1)] for c in range(columns)]
    gaps = [section.ground[~inside & (after == c)] for c in range(columns)]
    gap_start = np.concatenate([[0], np.cumsum([len(g) for g in gaps])]).astype(np.int32)
    return base, gap_start, np.concatenate([*gaps, np.empty((0, 4))])


@bare_kernel
def _raise(
    segments: NDArray[np.float64],
    sets: DownSets,
    base: tuple[NDArray[np.int32], NDArray[np.float64]],
    parent: NDArray[np.int32],
    printed: NDArray[np.int32],
    start: NDArray[np.int32],
    piece: NDArray[np.float64],
    top: NDArray[np.float64],
) -> bool:
    """Fill in all skylines, each from that of a smaller down-set; False where the room is too small.

    A printed toolpath has nothing above it, so that it replaces the skyline over its x-range.
    """
    set_start, step_start, step_path, step_to = sets.start, sets.step_start, sets.step_path, sets.step_to
    base_start, ground = base
    size = 0
    for c in range(len(set_start) - 1):
        for i in range(set_start[c], set_start[c + 1]):
            for e in range(step_start[i], step_start[i + 1]):
                parent[step_to[e]], printed[step_to[e]] = i, step_path[e]
            before = parent[i]
            low, high = (
                (start[before], start[before + 1]) if before >= 0 else (base_start[c], base_start[c + 1])
            )
            if size + 2 * (high - low) + 3 > len(piece):
                return False
            xl = xr = yl = yr = np.inf
            if before >= 0:
                s = printed[i]
                a = 0 if segments[s, 0, 0] <= segments[s, 1, 0] else 1
                xl, yl, xr, yr = (
                    segments[s, a, 0],
                    segments[s, a, 1],
                    segments[s, 1 - a, 0],
                    segments[s, 1 - a, 1],
                )
                if xr - xl <= EPS_MM:
                    yl = yr = max(yl, yr)
            for side in range(2):  # what is left of the toolpath, the toolpath, what is right of it
                for q in range(low, high):
                    source = piece if before >= 0 else ground
                    bl, hl, br, hr = source[q, 0], source[q, 1], source[q, 2], source[q, 3]
                    slope = (hr - hl) / (br - bl) if br - bl > EPS_MM else 0.0
                    if side == 0 and (bl < xl - EPS_MM or (br - bl <= EPS_MM and bl <= xl + EPS_MM)):
                        if br > xl:
                            br, hr = xl, hl + slope * (xl - bl)
                    elif side == 1 and (
                        br > xr + EPS_MM or (br - bl <= EPS_MM and bl >= xr - EPS_MM and xr > xl)
                    ):
                        if bl < xr:
                            bl, hl = xr, hl + slope * (xr - bl)
                    else:
                        continue
                    piece[size, 0], piece[size, 1], piece[size, 2], piece[size, 3] = bl, hl, br, hr
                    size += 1
                if side == 0 and before >= 0:
                    piece[size, 0], piece[size, 1], piece[size, 2], piece[size, 3] = xl, yl, xr, yr
                    size += 1
            start[i + 1] = size
            top[i] = -np.inf
            for q in range(start[i], size):
                top[i] = max(top[i], piece[q, 1], piece[q, 3])
    return True


def sets_of_states(blocks: Blocks, sets: DownSets) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Where each block begins, and the down-sets of the columns of each of its states, state by state."""
    rows, begin = [np.empty(0, np.int32)], [0]
    for k in range(blocks.blocks):
        states = blocks.dense[blocks.state_start[k] : blocks.state_start[k + 1]]
        at = np.stack(np.unravel_index(states, blocks.shape(k, sets)), axis=1)
        at += sets.start[blocks.bounds[k] : blocks.bounds[k + 1] + 1]
        rows.append(at.astype(np.int32).ravel())
        begin.append(begin[-1] + at.size)
    return np.array(begin, np.int64), np.concatenate(rows)
