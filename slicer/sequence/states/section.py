"""A section of a sequence that is to be ordered anew: the whole problem, or what a window holds."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.nozzle import NozzleBody
from slicer.sequence.problem import CostModel, Objective, Problem, compressed

NONE = -1


@dataclass(frozen=True, eq=False)
class Section:
    """Toolpaths with their precedence and columns, numbered from 0, and where the order begins and ends.

    Attributes:
        segments: float64 (n, 2, 2) in mm.
        pred_start, pred, succ_start, succ: the precedence both ways, as in ``Problem``.
        allowed: bool (n, 2), whether toolpath s may be printed in direction f.
        column: int32 (n,), the column of each toolpath; every number from 0 has a toolpath.
        starts: int32 (k,), oriented toolpaths to begin with. One toolpath, or all minimal ones, in directions
            that they may have.
        last: the oriented toolpath that the order must end with, or ``NONE``.
        cost_model: what a travel costs.
        routed: whether travels keep above what is printed.
        ground: float64 (q, 4), the skyline of what was printed before, in pieces [x left, y left, x right,
            y right] from left to right.
        extent: float64 (c, 2), least and greatest x of each column, the toolpaths outside the section
            included.
        body: the nozzle.
    """

    segments: NDArray[np.float64]
    pred_start: NDArray[np.int32]
    pred: NDArray[np.int32]
    succ_start: NDArray[np.int32]
    succ: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    column: NDArray[np.int32]
    starts: NDArray[np.int32]
    last: int
    cost_model: CostModel
    routed: bool
    ground: NDArray[np.float64]
    extent: NDArray[np.float64]
    body: NozzleBody

    @classmethod
    def whole(cls, problem: Problem, objective: Objective) -> "Section":
        """All of a problem, with its own start and a free end."""
        return cls(
            problem.segments,
            problem.pred_start,
            problem.pred,
            problem.succ_start,
            problem.succ,
            problem.allowed,
            problem.column,
            problem.starts,
            NONE,
            objective.cost_model,
            objective.routed,
            np.empty((0, 4)),
            extents(problem),
            problem.body,
        )

    @classmethod
    def window(
        cls,
        problem: Problem,
        objective: Objective,
        oriented: NDArray[np.int32],
        begin: int,
        end: int,
        ground: NDArray[np.float64],
        extent: NDArray[np.float64],
    ) -> "Section":
        """Consecutive toolpaths of a printable sequence, of which the first and the last one stay put.

        Where the window reaches the beginning of the sequence, it begins as the problem allows; where it
        reaches the end, that is free.

        Args:
            problem: the whole problem.
            objective: what is optimised.
            oriented: int32 (n,), the sequence.
            begin, end: the positions begin .. end - 1 are the window; toolpath t of the section is
                ``oriented[begin + t] >> 1`` of the problem.
            ground: the skyline before the window; of no interest unless the objective is routed.
            extent: ``extents(problem)``.
        """
        inner = oriented[begin:end]
        paths = inner >> 1
        inside = np.full(problem.n, NONE, np.int32)
        inside[paths] = np.arange(len(paths), dtype=np.int32)
        pred_start, pred = _restrict(problem.pred_start, problem.pred, paths, inside)
        succ_start, succ = _restrict(problem.succ_start, problem.succ, paths, inside)
        numbers, column = np.unique(problem.column[paths], return_inverse=True)
        starts = np.array([inner[0] & 1], np.int32)
        if begin == 0:
            begun = problem.starts
            begun = begun[inside[begun >> 1] != NONE]
            starts = np.sort(2 * inside[begun >> 1] + (begun & 1)).astype(np.int32)
        return cls(
            np.ascontiguousarray(problem.segments[paths]),
            pred_start,
            pred,
            succ_start,
            succ,
            problem.allowed[paths],
            column.astype(np.int32).ravel(),
            starts,
            NONE if end == problem.n else int(2 * (len(paths) - 1) + (inner[-1] & 1)),
            objective.cost_model,
            objective.routed,
            ground,
            extent[numbers],
            problem.body,
        )

    def part(self, chosen: NDArray[np.bool_]) -> "Section":
        """The chosen toolpaths, bool (n,), as one column; a first or last one that is among them stays so."""
        paths = np.flatnonzero(chosen).astype(np.int32)
        inside = np.full(self.n, NONE, np.int32)
        inside[paths] = np.arange(len(paths), dtype=np.int32)
        pred_start, pred = _restrict(self.pred_start, self.pred, paths, inside)
        succ_start, succ = _restrict(self.succ_start, self.succ, paths, inside)
        starts = self.starts[chosen[self.starts >> 1]]
        if self.first == NONE or len(starts) == 0:
            minimal = np.flatnonzero(np.diff(pred_start) == 0)
            starts = (2 * minimal[:, None] + np.arange(2)).ravel()
        else:
            starts = 2 * inside[starts >> 1] + (starts & 1)
        last = self.last
        if last != NONE:
            last = int(2 * inside[last >> 1] + (last & 1)) if chosen[last >> 1] else NONE
        return replace(
            self,
            segments=self.segments[paths],
            pred_start=pred_start,
            pred=pred,
            succ_start=succ_start,
            succ=succ,
            allowed=self.allowed[paths],
            column=np.zeros(len(paths), np.int32),
            starts=starts.astype(np.int32),
            last=last,
        )

    @property
    def n(self) -> int:
        """The number of toolpaths."""
        return len(self.segments)

    @property
    def columns(self) -> int:
        """The number of columns."""
        return int(self.column.max()) + 1 if self.n else 0

    @property
    def first(self) -> int:
        """The toolpath to begin with, or ``NONE`` where several may."""
        paths = np.unique(self.starts >> 1)
        return int(paths[0]) if len(paths) == 1 else NONE

    @property
    def within_columns(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """``pred_start`` and ``pred`` of the rows whose toolpaths share a column: all, for a point nozzle."""
        row = np.repeat(np.arange(self.n, dtype=np.int32), np.diff(self.pred_start))
        same = self.column[row] == self.column[self.pred]
        if same.all():
            return self.pred_start, self.pred
        return compressed(row[same], self.pred[same], self.n)

    @property
    def ties(self) -> NDArray[np.int32]:
        """int32 (m, 2), the rows of the precedence that join two columns, as in ``Problem.edges``."""
        row = np.repeat(np.arange(self.n, dtype=np.int32), np.diff(self.pred_start))
        apart = self.column[row] != self.column[self.pred]
        return np.stack([self.pred[apart], row[apart]], axis=1)


def extents(problem: Problem) -> NDArray[np.float64]:
    """float64 (c, 2), least and greatest x of each column of a problem."""
    x = problem.segments[:, :, 0]
    columns = int(problem.column.max()) + 1 if problem.n else 0
    out = np.full((columns, 2), [np.inf, -np.inf]).reshape(columns, 2)
    np.minimum.at(out[:, 0], problem.column, x.min(axis=1))
    np.maximum.at(out[:, 1], problem.column, x.max(axis=1))
    return out


@kernel
def _restrict(
    start: NDArray[np.int32],
    neighbour: NDArray[np.int32],
    paths: NDArray[np.int32],
    inside: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The rows ``paths`` of a compressed relation, with only those neighbours that are among them.

    What generates the precedence of the whole generates that of a convex subset, and what a window holds is
    one: whatever must come between two of its toolpaths comes between them in every order.
    """
    out_start = np.zeros(len(paths) + 1, np.int32)
    total = 0
    for s in paths:
        total += start[s + 1] - start[s]
    out = np.empty(total, np.int32)
    count = 0
    for t in range(len(paths)):
        for e in range(start[paths[t]], start[paths[t] + 1]):
            if inside[neighbour[e]] >= 0:
                out[count] = inside[neighbour[e]]
                count += 1
        out_start[t + 1] = count
    return out_start, out[:count].copy()
