"""What every sequencing method is given: endpoints, precedence both ways, and the start."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer import precedence
from slicer.cycles import check_acyclic
from slicer.errors import SequenceError
from slicer.nozzle import POINT, NozzleBody, allowed_directions
from slicer.sequence.problem.checks import truth, whole_number

REACH_MM = 1e5
"""Coordinates lie within this: 100 m away, floats are still much finer than ``precedence.EPS_MM``."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Toolpaths to be ordered and oriented.

    A toolpath s printed in direction f (0: from its first endpoint, 1: flipped) is the *oriented
    toolpath* ``2 * s + f``. It is entered at ``segments[s, f]`` and left at ``segments[s, 1 - f]``.

    Attributes:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm, C-contiguous.
        edges: int32 (m, 2), row (a, b): a is printed before b. Their closure is the precedence: without a
            body the covering relation of "is below", else also what would stand in the nozzle's way.
        below: int32 (k, 2), the covering relation of "is below" alone, which is planar.
        pred_start, pred: int32 (n + 1,) and (m,); ``edges`` by their later toolpath: those to be printed
            before s, each at least by way of others, are ``pred[pred_start[s]:pred_start[s + 1]]``.
        succ_start, succ: the same by their earlier toolpath.
        column: int32 (n,), the column of each toolpath. Of a point nozzle columns are tied by cost alone; a
            body ties them by precedence too.
        body: the nozzle.
        allowed: bool (n, 2), whether toolpath s may be printed in direction f; one of the two always.
        first: the toolpath to begin with, or None where any printable one may be.
        first_flipped: the direction of the first toolpath, or None where it is free. Without ``first``
            it holds for whichever toolpath comes first.
    """

    segments: NDArray[np.float64]
    edges: NDArray[np.int32]
    below: NDArray[np.int32]
    pred_start: NDArray[np.int32]
    pred: NDArray[np.int32]
    succ_start: NDArray[np.int32]
    succ: NDArray[np.int32]
    column: NDArray[np.int32]
    body: NozzleBody
    allowed: NDArray[np.bool_]
    first: int | None
    first_flipped: bool | None

    @classmethod
    def build(
        cls,
        segments: ArrayLike,
        *,
        body: NozzleBody = POINT,
        downhill_deg: float = 90.0,
        edges: NDArray[np.int32] | None = None,
        first: int | None = None,
        first_flipped: bool | None = None,
    ) -> "Problem":
        """Derive the precedence of ``segments`` (n, 2, 2) in mm.

        Args:
            body: the nozzle, for which toolpaths can stand in one another's way.
            downhill_deg: steepest tilt at which a toolpath may be printed downwards, see
                ``nozzle.allowed_directions``.
            edges: int32 (m, 2), a precedence without cycles to take instead of the derived one, where some of
                that is given up (``slicer.cutting.press``).
            first, first_flipped: see ``Problem``.

        Raises:
            CrossingError: two toolpaths cross.
            CycleError: toolpaths stand in one another's way, so that no order is printable.
            SequenceError: the segments have another shape, or reach beyond ``REACH_MM``; ``first`` is no
                toolpath, or cannot be printed first; ``first_flipped`` is no truth value, or a direction that
                nothing which could be first may be printed in.
            SlicerError: a coordinate is not finite.
        """
        lines = _lines(segments)
        if first is not None:
            first = whole_number(
                "first toolpath", first, "Give the index of a toolpath, or None to leave the start free."
            )
        if first_flipped is not None:
            first_flipped = truth("first_flipped", first_flipped, "Give None to leave the direction free.")
        below = precedence.covering_edges(lines)
        n = len(lines)
        if edges is None:
            edges = below
        if not body.is_point and edges is below:
            edges = precedence.hindering_edges(lines, body)
            check_acyclic(n, edges)
        allowed = allowed_directions(lines, downhill_deg)
        pred_start, pred = compressed(edges[:, 1], edges[:, 0], n)
        succ_start, succ = compressed(edges[:, 0], edges[:, 1], n)
        if first is not None and n:
            if not 0 <= first < n:
                raise SequenceError(f"first toolpath {first}: there are {n}, numbered from 0")
            under = pred[pred_start[first] : pred_start[first + 1]]
            if len(under):
                why = "lies above" if (below[:, 1] == first).any() else "would stand in the nozzle's way of"
                low = below[below[:, 1] == first, 0] if why == "lies above" else under
                raise SequenceError(
                    f"first toolpath {first} {why} toolpath {low[0]}, which must be printed before "
                    "it. Name a toolpath that has nothing below it, or leave the start free."
                )
        problem = cls(
            lines,
            edges,
            below,
            pred_start,
            pred,
            succ_start,
            succ,
            precedence.columns(lines),
            body,
            allowed,
            first if n else None,
            first_flipped,
        )
        if n and len(problem.starts) == 0:
            which = (
                "no toolpath that can be printed first" if first is None else f"first toolpath {first} not"
            )
            raise SequenceError(
                f"first_flipped {first_flipped}: {which} may be printed from that end with downhill_deg "
                f"{downhill_deg:g}, since it would run down more steeply. Leave the direction free."
            )
        return problem

    def part(self, toolpaths: NDArray[np.intp], *, begins: bool) -> "Problem":
        """The same of whole columns alone, none of them tied to another one.

        Args:
            toolpaths: int (k,), ascending; toolpath t of the part is ``toolpaths[t]`` here.
            begins: whether it comes first; else it may begin and end wherever it likes.
        """
        inside = np.full(self.n, -1, np.int32)
        inside[toolpaths] = np.arange(len(toolpaths), dtype=np.int32)
        edges, below = (inside[rows[inside[rows[:, 0]] >= 0]] for rows in (self.edges, self.below))
        pred_start, pred = compressed(edges[:, 1], edges[:, 0], len(toolpaths))
        succ_start, succ = compressed(edges[:, 0], edges[:, 1], len(toolpaths))
        return Problem(
            np.ascontiguousarray(self.segments[toolpaths]),
            edges,
            below,
            pred_start,
            pred,
            succ_start,
            succ,
            np.unique(self.column[toolpaths], return_inverse=True)[1].astype(np.int32),
            self.body,
            self.allowed[toolpaths],
            int(inside[self.first]) if begins and self.first is not None else None,
            self.first_flipped if begins else None,
        )

    def stretched(self, upwards: float) -> "Problem":
        """The same with all heights times ``upwards``, so that one way up the sheet counts more than across.

        What must be printed before what stays, and so every sequence is printable there that is so here.
        """
        return replace(self, segments=self.segments * np.array([1.0, upwards]))

    @property
    def n(self) -> int:
        """The number of toolpaths."""
        return len(self.segments)

    @property
    def starts(self) -> NDArray[np.int32]:
        """int32 (k,), the oriented toolpaths that the sequence may begin with, ascending."""
        minimal = np.flatnonzero(np.diff(self.pred_start) == 0)
        toolpaths = minimal if self.first is None else np.array([self.first])
        directions = [0, 1] if self.first_flipped is None else [int(self.first_flipped)]
        oriented = np.sort(np.add.outer(2 * toolpaths, directions).ravel()).astype(np.int32)
        return oriented[self.allowed.ravel()[oriented]]

    @property
    def planar(self) -> bool:
        """Whether the precedence is that of "is below" alone, so that it ties no columns."""
        return np.array_equal(self.edges, self.below)

    def travel_mm(self, order: ArrayLike, flipped: ArrayLike) -> float:
        """Straight travel J: the sum of the distances from each toolpath's end to the next one's start.

        Args:
            order: int (n,), the toolpath that is printed k-th.
            flipped: bool (n,), whether the k-th is printed from its second endpoint.
        """
        sequence, flip = np.asarray(order, np.intp), np.asarray(flipped, np.intp)
        start = self.segments[sequence, flip]
        end = self.segments[sequence, 1 - flip]
        return float(np.hypot(*(start[1:] - end[:-1]).T).sum())

    def refusal(self, order: ArrayLike, flipped: ArrayLike | None = None) -> str | None:
        """Why an order is not an answer to the problem, or None where it is one.

        Args:
            order: int (n,), the toolpath that is printed k-th.
            flipped: bool (n,), whether the k-th is printed from its second endpoint; None where only the
                order is in question.
        """
        sequence = np.asarray(order, np.int64)
        if not np.array_equal(np.sort(sequence), np.arange(self.n)):
            return f"it does not hold each of the {self.n} toolpaths exactly once"
        if self.first is not None and sequence[0] != self.first:
            return f"it begins with toolpath {sequence[0]}, not {self.first}"
        broken = precedence.violations(sequence, self.edges)
        if len(broken):
            low, high = self.edges[broken[0]]
            plain = ((self.below[:, 0] == low) & (self.below[:, 1] == high)).any()
            what = "lies below" if plain else "is hindered by"
            return f"toolpath {low} {what} {high} but comes after it ({len(broken)} such pairs)"
        if flipped is None or self.n == 0:
            return None
        flips = np.asarray(flipped, np.intp)
        if self.first_flipped is not None and bool(flips[0]) != self.first_flipped:
            return "it begins in the other direction than the first toolpath must"
        barred = np.flatnonzero(~self.allowed[sequence, flips])
        if len(barred):
            s, f = sequence[barred[0]], flips[barred[0]]
            (x0, y0), (x1, y1) = self.segments[s, f], self.segments[s, 1 - f]
            return (
                f"toolpath {s} runs down from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) mm, which is steeper than "
                f"the nozzle may ({len(barred)} such toolpaths)"
            )
        return None


def _lines(segments: ArrayLike) -> NDArray[np.float64]:
    """The segments as C-contiguous float64 (n, 2, 2), if that is what they are."""
    try:
        lines = np.ascontiguousarray(segments, np.float64)
    except (TypeError, ValueError) as why:
        raise SequenceError(
            f"segments cannot be read as numbers of shape (n, 2, 2), [endpoint, xy]: {why}"
        ) from why
    if lines.size == 0:
        lines = lines.reshape(0, 2, 2)
    if lines.ndim != 3 or lines.shape[1:] != (2, 2):
        raise SequenceError(f"segments have shape {lines.shape}, but must have (n, 2, 2): [endpoint, xy]")
    far = np.isfinite(lines) & (np.abs(lines) > REACH_MM)
    if far.any():
        toolpath, end, axis = np.argwhere(far)[0]
        raise SequenceError(
            f"toolpath {toolpath} reaches {'xy'[axis]} = {lines[toolpath, end, axis]:g} mm, but coordinates "
            f"must lie within {REACH_MM:g} mm of the origin. Give them in mm, and move the sheet nearer."
        )
    return lines


def compressed(
    rows: NDArray[np.int32], values: NDArray[np.int32], n: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Group ``values`` by row: those of row s are ``grouped[start[s]:start[s + 1]]``."""
    start = np.zeros(n + 1, np.int32)
    np.cumsum(np.bincount(rows, minlength=n), out=start[1:])
    return start, np.ascontiguousarray(values[np.argsort(rows, kind="stable")])
