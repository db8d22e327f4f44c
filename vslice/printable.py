"""From hatch lines to toolpaths that a nozzle can print in some order, and the problem of finding it."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slicer import cutting
from slicer.cutting import Cut, RelaxedPrecedence
from slicer.errors import CycleError, SlicerError
from slicer.hatch import Hatch
from slicer.nozzle import POINT, NozzleBody, press_depths
from slicer.sequence import Problem

Conflicts = Literal["cut", "press", "refuse"]
"""What becomes of toolpaths that stand in one another's way in a ring."""

SHOWN = 3
"""Groups of toolpaths that an error names."""


@dataclass(frozen=True, eq=False)
class Printable:
    """Toolpaths that can be printed in some order, and what it took.

    Attributes:
        lines: the toolpaths, or pieces of them.
        problem: the sequencing problem.
        cut: how they were cut; None where nothing was.
        pressed: where the nozzle presses deeper than it may; None where it nowhere does.
    """

    lines: Hatch
    problem: Problem
    cut: Cut | None = None
    pressed: RelaxedPrecedence | None = None

    @property
    def toolpath(self) -> NDArray[np.int32]:
        """int32 (n,), the hatch line that each is, or is a piece of."""
        return np.arange(len(self.lines.segments), dtype=np.int32) if self.cut is None else self.cut.toolpath

    @property
    def hatch_lines(self) -> int:
        """How many toolpaths there were before any was cut."""
        return int(self.toolpath.max()) + 1 if len(self.toolpath) else 0

    @property
    def ends(self) -> NDArray[np.bool_] | None:
        """bool (n, 2), which endpoints are ends of hatch lines, not cuts within one; None where all are."""
        return None if self.cut is None else self.cut.ends


def counted_join_mm(join_mm: float, ends: NDArray[np.bool_] | None) -> float:
    """Up to which length an objective should count hops as extruded, which knows no ends from cuts: not at
    all where most are cuts.
    """
    return join_mm if ends is None or ends.mean() > 0.5 else 0.0


def printable(
    source: str,
    lines: Hatch,
    start: str,
    body: NozzleBody = POINT,
    downhill_deg: float = 90.0,
    conflicts: Conflicts = "cut",
    overlap_mm: float = 0.0,
) -> Printable:
    """Make a sequencing problem of hatch lines.

    Args:
        start: from the "corner", as in the source paper, or "free". The corner is the lower end of toolpath
            0, the lowest of the bottom left tile; where a body forbids to begin there, the start is free.
        source: the name of the grid, for messages.
        conflicts: what to do where toolpaths stand in one another's way in a ring: "cut" them, "press" the
            nozzle into them as little as can be, or "refuse".
        overlap_mm: how far pieces of a toolpath are to reach over one another.

    Raises:
        SlicerError: they do and are refused, or cannot be cut.
    """
    try:
        problem = Problem.build(lines.segments, body=body, downhill_deg=downhill_deg)
    except CycleError as error:
        if conflicts == "refuse":
            raise SlicerError(_refusal(source, lines, body, error)) from None
        rings = error.components
    else:
        return Printable(lines, _from(problem, start, np.arange(problem.n)))
    if conflicts == "press":
        pressed = cutting.press(lines.segments, body)
        problem = Problem.build(lines.segments, body=body, downhill_deg=downhill_deg, edges=pressed.edges)
        return Printable(lines, _from(problem, start, np.arange(problem.n)), pressed=pressed)
    try:
        if overlap_mm > 0:
            body = cutting.less_pressed(body, overlap_mm)
        cut = cutting.cut(lines.segments, body, rings=None if overlap_mm > 0 else rings)
    except SlicerError as error:
        raise SlicerError(f"{source}: {error}") from None
    lines = Hatch(cut.segments, lines.tile[cut.toolpath], lines.dropped)
    problem = Problem.build(cut.segments, body=body, downhill_deg=downhill_deg)
    return Printable(lines, _from(problem, start, cut.toolpath), cut=cut)


def problem_of(segments: NDArray[np.float64], start: str) -> Problem:
    """The problem of toolpaths (n, 2, 2) for a nozzle that is a point; ``start`` as for ``printable``."""
    return _from(Problem.build(segments), start, np.arange(len(segments)))


def _from(problem: Problem, start: str, toolpath: NDArray[np.intp] | NDArray[np.int32]) -> Problem:
    """The problem with its start at the corner, where that is asked for and can be."""
    if start == "free" or problem.n == 0:
        return problem
    pieces = np.flatnonzero(toolpath == toolpath[0])
    first = int(pieces[np.argmin(problem.segments[pieces, :, 1].min(axis=1))])
    flipped = bool(problem.segments[first, 1, 1] < problem.segments[first, 0, 1])
    if problem.pred_start[first + 1] > problem.pred_start[first] or not problem.allowed[first, int(flipped)]:
        return problem
    return replace(problem, first=first, first_flipped=flipped)


def _refusal(source: str, lines: Hatch, body: NozzleBody, error: CycleError) -> str:
    """Which toolpaths of which tiles, and how deep."""
    groups = error.components
    total = sum(map(len, groups))
    said = []
    for group in groups[:SHOWN]:
        a, b = np.repeat(group, len(group)), np.tile(group, len(group))
        apart = a != b
        a, b = a[apart].astype(np.int64), b[apart].astype(np.int64)
        depth = press_depths(body, np.ascontiguousarray(lines.segments), a, b)
        k = int(np.argmax(depth))
        said.append(
            f"  toolpath {a[k]} of tile {_tile(lines, a[k])} would push {depth[k]:.3f} mm deep into the "
            f"nozzle while toolpath {b[k]} of tile {_tile(lines, b[k])} is printed, and "
            + ("the other way round" if len(group) == 2 else f"{len(group) - 2} more wait in the same ring")
        )
    more = f"\n  and {len(groups) - SHOWN} more rings" if len(groups) > SHOWN else ""
    return (
        f"{source}: {total} of {len(lines.segments)} toolpaths stand in one another's way with this nozzle, "
        f"in {len(groups)} ring{'s' if len(groups) > 1 else ''}; {body.press:.3f} mm may be pressed:\n"
        + "\n".join(said)
        + more
        + "\nHave them cut (--conflicts cut), press all the same (--conflicts press), or take another nozzle "
        f"('vslice nozzles {source}' compares them)."
    )


def _tile(lines: Hatch, s: np.int64) -> str:
    col, row = lines.tile[s]
    return f"({col}, {row})"
