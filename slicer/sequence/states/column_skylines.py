"""The skyline over each down-set of a column.

Where a travel has to go depends on what is printed: on the down-set of each column that it passes. So the
skylines are made once for all down-sets, and a search that knows the down-sets knows every travel. What
toolpaths forbid to a nozzle with a body reaches over the borders of their column: the skylines of columns
overlap then, and the greatest counts.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, kernel
from slicer.nozzle import NozzleBody
from slicer.reach import MOST_LINES, reach
from slicer.sequence.states.blocks import Blocks
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import Section
from slicer.skyline import FULL, Skyline, append, clear, copied, lay, skyline_with_room

MOST_PIECES = 64
"""Room for pieces of a skyline at first; it doubles as needed."""


class Steps(NamedTuple):
    """The steps of ``DownSets`` by where they lead to.

    Attributes:
        start: int32 (d + 1,), the steps to each down-set.
        path, origin: int32 (e,), the toolpath that each prints, and the down-set it comes from.
    """

    start: NDArray[np.int32]
    path: NDArray[np.int32]
    origin: NDArray[np.int32]


class Skylines(NamedTuple):
    """Skylines as pieces [x left, y left, x right, y right] from left to right; uprights have no width.

    Attributes:
        routed: whether travels keep above what is printed; if not, the rest is empty.
        start: int32 (d + 1,), the pieces of each down-set.
        piece: float64 (p, 4), in mm.
        top: float64 (d,), the greatest height of each down-set's skyline.
        gap_start: int32 (c + 1,), the pieces of what stands between column c - 1 and column c for good.
        gap: float64 (q, 4), in mm. With a body, all that was printed before, in one skyline.
        hull: float64 (h, 2), scratch for the points of a taut string.
        over: float64 (h, 2), scratch for what stands above a straight travel.
        lines: float64 (MOST_LINES, 4), scratch for the reach of a toolpath.
        reached: int32 (2,), whose reach that is, or -1, and how many lines it has.
        body: the nozzle. What follows is empty for a point.
        floor: the lowest y of the section's toolpaths, in mm.
        steps: how each down-set comes about.
        reaching: int32 (c, 2), the first and the last column that reach into each.
    """

    routed: bool
    start: NDArray[np.int32]
    piece: NDArray[np.float64]
    top: NDArray[np.float64]
    gap_start: NDArray[np.int32]
    gap: NDArray[np.float64]
    hull: NDArray[np.float64]
    over: NDArray[np.float64]
    lines: NDArray[np.float64]
    reached: NDArray[np.int32]
    body: NozzleBody
    floor: float
    steps: Steps
    reaching: NDArray[np.int32]


def skylines(section: Section, sets: DownSets) -> Skylines:
    """The skylines of all down-sets of a section, over what was printed before it."""
    if not section.routed:
        return over_nothing(section)
    none, empty, points = np.zeros(1, np.int32), np.empty((0, 4)), np.empty((0, 2))
    no_steps, lines = Steps(none, none, none), np.empty((MOST_LINES, 4))
    reached = np.array([-1, 0], np.int32)
    body, nobody = section.body, np.empty((0, 2), np.int32)
    columns = section.columns
    floor = float(section.segments[:, :, 1].min()) if section.n else 0.0
    if body.is_point:
        base, gap_start, gap = _ground(section)
    else:
        base, gap_start, gap = [empty] * columns, none, section.ground
    base_start = np.concatenate([[0], np.cumsum([len(b) for b in base])]).astype(np.int32)
    ground = np.concatenate([*base, empty])
    count = int(sets.start[columns])
    start = np.zeros(count + 1, np.int32)
    top = np.full(count, -np.inf)
    room, most = MOST_PIECES * count + len(ground), MOST_PIECES + 2 * len(ground)
    while True:
        piece = np.empty((room, 4))
        if _raise(
            skyline_with_room(most, body, floor),
            section.segments,
            sets,
            (base_start, ground),
            (np.full(count, -1, np.int32), np.full(count, -1, np.int32)),
            start,
            piece,
            top,
        ):
            break
        room, most = 2 * room, 2 * most
    widest = int(np.diff(start).max()) if count else 0
    scratch = 2 * (widest * columns + len(gap) + MOST_LINES) + 8
    return Skylines(
        True,
        start,
        piece[: start[-1]].copy(),
        top,
        gap_start,
        gap,
        np.empty((scratch, 2)),
        points if body.is_point else np.empty((scratch, 2)),
        lines,
        reached,
        body,
        floor,
        no_steps if body.is_point else _backwards(sets),
        nobody if body.is_point else _reaching(section, floor),
    )


def over_nothing(section: Section) -> Skylines:
    """Skylines without a down-set."""
    none, empty, points = np.zeros(1, np.int32), np.empty((0, 4)), np.empty((0, 2))
    return Skylines(
        section.routed,
        none,
        empty,
        np.empty(0),
        none,
        empty,
        points,
        points,
        np.empty((MOST_LINES, 4)),
        np.array([-1, 0], np.int32),
        section.body,
        0.0,
        Steps(none, none, none),
        np.empty((0, 2), np.int32),
    )


def _backwards(sets: DownSets) -> Steps:
    """The steps by where they lead to."""
    by_end = np.argsort(sets.step_to, kind="stable")
    count = len(sets.step_start) - 1
    start = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(sets.step_to, minlength=count), out=start[1:])
    origin = np.repeat(np.arange(count, dtype=np.int32), np.diff(sets.step_start))
    return Steps(start, sets.step_path[by_end], origin[by_end])


def _reaching(section: Section, floor: float) -> NDArray[np.int32]:
    """int32 (c, 2), the first and the last column of which something may stand over each column."""
    columns = section.columns
    x, own = reach_extents(section.body, floor, section.segments), section.segments[:, :, 0]
    low, high, left, right = np.full((4, columns), [[np.inf], [-np.inf], [np.inf], [-np.inf]])
    np.minimum.at(low, section.column, x[:, 0])
    np.maximum.at(high, section.column, x[:, 1])
    np.minimum.at(left, section.column, own.min(axis=1))
    np.maximum.at(right, section.column, own.max(axis=1))
    over = (high > left[:, None]) & (low < right[:, None])  # [c, d]: column d reaches into column c
    over |= np.eye(columns, dtype=bool)
    return np.stack([over.argmax(axis=1), columns - 1 - over[:, ::-1].argmax(axis=1)], axis=1).astype(
        np.int32
    )


@kernel
def reach_extents(body: NozzleBody, floor: float, segments: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64 (n, 2), the least and the greatest x at which each toolpath forbids anything to the tip."""
    out = np.empty((len(segments), 2))
    lines = np.empty((MOST_LINES, 4))
    for s in range(len(segments)):
        out[s, 0] = min(segments[s, 0, 0], segments[s, 1, 0])
        out[s, 1] = max(segments[s, 0, 0], segments[s, 1, 0])
        for k in range(reach(body, floor, segments[s], lines)):
            out[s, 0], out[s, 1] = min(out[s, 0], lines[k, 0]), max(out[s, 1], lines[k, 2])
    return out


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
    sky: Skyline,
    segments: NDArray[np.float64],
    sets: DownSets,
    base: tuple[NDArray[np.int32], NDArray[np.float64]],
    came: tuple[NDArray[np.int32], NDArray[np.int32]],
    start: NDArray[np.int32],
    piece: NDArray[np.float64],
    top: NDArray[np.float64],
) -> bool:
    """Fill in all skylines, each from that of a smaller down-set; False where the room is too small.

    ``came`` is filled with a smaller down-set for each, and the toolpath that is printed on it.
    """
    set_start, step_start, step_path, step_to = sets.start, sets.step_start, sets.step_path, sets.step_to
    base_start, ground = base
    parent, printed = came
    size = 0
    for c in range(len(set_start) - 1):
        for i in range(set_start[c], set_start[c + 1]):
            for e in range(step_start[i], step_start[i + 1]):
                parent[step_to[e]], printed[step_to[e]] = i, step_path[e]
            before = parent[i]
            first, last = base_start[c], base_start[c + 1]
            if before >= 0:
                first, last = start[before], start[before + 1]
            if last - first + 8 > len(sky.piece):
                return False
            clear(sky)
            for q in range(first, last):
                append(sky, piece if before >= 0 else ground, q)
            if before >= 0 and not lay(sky, segments[printed[i]]):
                return False
            size = copied(sky, piece, size)
            if size == FULL:
                return False
            top[i] = -np.inf
            for q in range(start[i], size):
                top[i] = max(top[i], piece[q, 1], piece[q, 3])
            start[i + 1] = size
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
