"""Cut toolpaths that stand in one another's way, as few as can be found, so that an order exists."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slicer import precedence
from slicer.cutting.fewest import fewest_cuts
from slicer.cutting.gluing import glue
from slicer.cutting.greedy import cut_greedily
from slicer.cycles import groups
from slicer.errors import SlicerError
from slicer.nozzle import NozzleBody

HALVINGS = 8
"""How often shorter parts are tried where none of the wanted length can be printed."""

MOST_PARTS = 200
"""Of a toolpath, on average, before it is given up."""

LARGEST = 12_000
"""Toolpaths in one component: all of its pairs are held in memory, a byte each."""


@dataclass(frozen=True, eq=False)
class Cut:
    """Toolpaths, some of them in pieces that meet.

    Attributes:
        segments: float64 (m, 2, 2), [endpoint, xy] in mm: the pieces, each in the direction of its toolpath.
        toolpath: int32 (m,), ascending: which of the given toolpaths each is, or is a piece of.
        ends: bool (m, 2), whether endpoint [1] of piece [0] is an end of its toolpath, not a cut.
        fewest: no way of printing takes fewer cuts.
    """

    segments: NDArray[np.float64]
    toolpath: NDArray[np.int32]
    ends: NDArray[np.bool_]
    fewest: int

    @property
    def cuts(self) -> int:
        """How many cuts were made."""
        return len(self.toolpath) - len(np.unique(self.toolpath))

    @property
    def toolpaths_cut(self) -> int:
        """How many toolpaths are in pieces."""
        return int((np.bincount(self.toolpath) > 1).sum()) if len(self.toolpath) else 0


def cut(
    segments: NDArray[np.float64],
    body: NozzleBody,
    *,
    least_mm: float | None = None,
    rings: list[NDArray[np.intp]] | None = None,
) -> Cut:
    """Cut toolpaths where, and only where, something stands in the way.

    Only toolpaths of a cycle are cut. Pieces of horizontal bands no higher than ``body.press`` never hinder
    one another, so that enough cuts always do: in the limit it is planar slicing.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        body: the nozzle.
        rings: the toolpaths of each ring under this body, as ``CycleError`` has them, where they are known.
        least_mm: no piece is shorter, unless there is no other way; half of ``body.press`` by default.

    Raises:
        CrossingError: two toolpaths cross.
        SlicerError: no number of pieces is enough, which needs a ``press`` of next to nothing; a component of
            more toolpaths than can be held in memory.
    """
    n = len(segments)
    if rings is None:
        rings = groups(n, precedence.hindering_edges(segments, body))
    owner = [np.setdiff1d(np.arange(n), np.concatenate(rings) if rings else [])]
    span = [np.tile([0.0, 1.0], (len(owner[0]), 1))]
    fewest = 0
    for members in rings:
        inner = np.ascontiguousarray(segments[members])
        of, where = _cut_component(inner, body, body.press / 2 if least_mm is None else least_mm, members)
        owner.append(members[of])
        span.append(where)
        fewest += fewest_cuts(body, inner)
    toolpath, spans = np.concatenate(owner), np.concatenate(span)
    order = np.lexsort((spans[:, 0], toolpath))
    toolpath, spans = toolpath[order], spans[order]
    whole = segments[toolpath]
    pieces = whole[:, :1] + spans[:, :, None] * (whole[:, 1:] - whole[:, :1])
    pieces[spans == 1.0] = whole[:, 1][(spans == 1.0)[:, 1]]  # to the last bit, for whole toolpaths too
    ends = spans == np.array([0.0, 1.0])
    return Cut(np.ascontiguousarray(pieces), np.array(toolpath, np.int32), ends, fewest)


def _cut_component(
    segments: NDArray[np.float64], body: NozzleBody, least_mm: float, members: NDArray[np.intp]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The toolpath and the span of each piece of one component."""
    n = len(segments)
    if n > LARGEST:
        raise SlicerError(
            f"{n} toolpaths wait for one another, but no more than {LARGEST} can be cut together. Take a "
            "narrower nozzle, or let it press deeper."
        )
    for halving in range(HALVINGS + 1):
        owner, span = cut_greedily(body, segments, max(least_mm / 2**halving, 1e-6), MOST_PARTS * n)
        done = np.bincount(owner, span[:, 1] - span[:, 0], minlength=n)
        if (done > 1 - 1e-9).all():
            left = glue(body, segments, owner, span)
            return owner[left], span[left]
    stuck = int(members[int(np.flatnonzero(done <= 1 - 1e-9)[0])])
    raise SlicerError(
        f"toolpath {stuck} and {n - 1} others stand in one another's way however they are cut: the body may "
        f"be pressed by {body.press:g} mm (press_mm), which is too little for it. Let it press deeper."
    )
