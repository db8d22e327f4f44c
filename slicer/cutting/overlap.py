"""Let pieces of a toolpath reach over one another, so that the fibre stays one."""

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from slicer.cutting.cut import Cut
from slicer.cutting.hindering import hindering_parts
from slicer.errors import SlicerError
from slicer.nozzle import NozzleBody

LEAST_MM = 0.001
"""Positions are written with three decimals: what is shorter is left out."""


def overlapping(cut: Cut, order: ArrayLike, body: NozzleBody, overlap_mm: float) -> NDArray[np.float64]:
    """Lengthen each piece over what was printed of its toolpath before, as far as nothing is in the way.

    Cuts are made where the nozzle just presses as deep as it may, so that there is room only where the pieces
    were cut and ordered for a body that may press less: by ``overlap_mm``, see ``less_pressed``. Half of each
    piece stays its own, however short it is.

    Args:
        cut: the pieces.
        order: int (m,), the piece that is printed k-th.
        body: the nozzle.
        overlap_mm: how far; no farther than to the middle of the other piece.

    Returns:
        float64 (m, 2, 2), the pieces as they are to be laid.
    """
    sequence = np.asarray(order, np.int64)
    laid = cut.segments.copy()
    place = np.empty(len(sequence), np.int64)
    place[sequence] = np.arange(len(sequence))
    first, second = _joints(cut)
    if overlap_mm <= 0 or len(first) == 0:
        return laid
    tree = shapely.STRtree(shapely.linestrings(cut.segments))
    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        # a ends where b begins; the later of the two is lengthened over the earlier one.
        late, early, end = (b, a, 0) if place[a] < place[b] else (a, b, 1)
        joint, other = cut.segments[late, end], cut.segments[early, end]
        length = float(np.hypot(*(other - joint)))
        part = np.array([joint, joint + min(0.5, overlap_mm / length) * (other - joint)])
        reach = body.half_width + body.flank * min(body.length, 1e3) + body.shoulder + 1.0
        (x0, y0), (x1, _) = part.min(axis=0), part.max(axis=0)
        free = 1.0
        for k in tree.query(shapely.box(x0 - reach, y0, x1 + reach, 1e6)).tolist():
            if place[k] < place[late] and cut.toolpath[k] != cut.toolpath[late]:
                found = hindering_parts(body, cut.segments[k], part)
                held = found[:, 2] <= found[:, 3]
                free = min(free, float(found[held, 2].min(initial=1.0)))
        tip = joint + free * (part[1] - joint)
        if np.hypot(*(tip - joint)) >= LEAST_MM:
            laid[late, end] = tip
    return laid


def less_pressed(body: NozzleBody, overlap_mm: float) -> NozzleBody:
    """The body to cut and order pieces for that are to overlap by so much.

    Raises:
        SlicerError: so much cannot be pressed less.
    """
    if overlap_mm >= body.press:
        raise SlicerError(
            f"overlap_mm {overlap_mm:g} must be below press_mm, {body.press:g}: a piece that reaches back "
            "presses so much deeper beside its neighbours."
        )
    return body._replace(press=body.press - overlap_mm)


def _joints(cut: Cut) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of pieces that meet: they stand one after the other, in the direction of their toolpath."""
    meets = np.flatnonzero(cut.toolpath[1:] == cut.toolpath[:-1])
    return meets, meets + 1
