"""Hatch lines that are printed in pieces, at different times: which are whose, and what they leave open."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcode.strokes import MATCH_MM, Stroke


class Pieces(NamedTuple):
    """What was found of hatch lines among strokes that are no whole ones.

    Attributes:
        owner: int (s,), the hatch line that each stroke is a piece of, or -1.
        again: bool (s,), whether other pieces of its line already print all of it.
        open_mm: float64 (n,), how much of each hatch line no piece prints.
        exact: float64 (p, 5), each piece from (x, y) to (x, y) on its hatch line, and its program line.
    """

    owner: NDArray[np.intp]
    again: NDArray[np.bool_]
    open_mm: NDArray[np.float64]
    exact: NDArray[np.float64]


def pieces_of(lines: NDArray[np.float64], strokes: Sequence[Stroke]) -> Pieces:
    """Give each stroke to the hatch line along which it lies, where there is one.

    Args:
        lines: float64 (n, 2, 2), hatch lines that no stroke prints as a whole.
        strokes: movements that lay material and print no whole hatch line.
    """
    owner, place = _owners(lines, strokes)
    again = np.zeros(len(strokes), np.bool_)
    step = lines[:, 1] - lines[:, 0]
    open_mm = np.hypot(*step.T)
    exact = []
    for line in np.unique(owner[owner >= 0]):
        own = np.flatnonzero(owner == line)
        length, reached, left = float(open_mm[line]), 0.0, 0.0
        begin, end = place[own].min(axis=1) * length, place[own].max(axis=1) * length
        for k in np.lexsort((-end, begin)):
            again[own[k]] = end[k] <= reached
            left += max(0.0, float(begin[k]) - reached)
            reached = max(reached, float(end[k]))
        left += max(0.0, length - reached)
        open_mm[line] = left if left > MATCH_MM else 0.0
        ends = lines[line, 0] + np.clip(place[own], 0.0, 1.0)[:, :, None] * step[line]
        number = np.array([strokes[k].line for k in own.tolist()], np.float64)
        exact.append(np.column_stack([ends.reshape(-1, 4), number]))
    return Pieces(owner, again, open_mm, np.concatenate(exact) if exact else np.empty((0, 5)))


def _owners(
    lines: NDArray[np.float64], strokes: Sequence[Stroke]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The nearest line along which each stroke lies, or -1, and where its ends lie on it, from 0 to 1."""
    owner, place = np.full(len(strokes), -1, np.intp), np.zeros((len(strokes), 2))
    if len(lines) == 0 or len(strokes) == 0:
        return owner, place
    import shapely

    drawn = np.array([(s.x0, s.y0, s.x1, s.y1) for s in strokes], np.float64).reshape(-1, 2, 2)
    tree = shapely.STRtree(shapely.linestrings(lines))
    stroke, line = tree.query(shapely.points(drawn.mean(axis=1)), predicate="dwithin", distance=MATCH_MM)
    step = lines[line, 1] - lines[line, 0]
    length = np.maximum(np.hypot(*step.T), 1e-12)
    along = step / length[:, None]
    offset = drawn[stroke] - lines[line, None, 0]
    on = (offset * along[:, None]).sum(axis=2)
    aside = np.abs(offset[..., 0] * along[:, None, 1] - offset[..., 1] * along[:, None, 0]).max(axis=1)
    fits = (aside <= MATCH_MM) & (on.min(axis=1) >= -MATCH_MM) & (on.max(axis=1) <= length + MATCH_MM)
    # The nearest line comes last, and stays.
    for k in np.flatnonzero(fits)[np.argsort(-aside[fits], kind="stable")]:
        owner[stroke[k]], place[stroke[k]] = line[k], on[k] / length[k]
    return owner, place
