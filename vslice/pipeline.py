"""The main job, grid file to program: what ``slice`` writes and ``send`` streams."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import profiles
from gcode import emit, program
from profiles import Profile
from slicer import grid, hatch, sequence, travel
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.hatch import Hatch
from slicer.sequence import Problem, Result
from slicer.travel import Plan
from vslice import __version__


@dataclass(frozen=True, eq=False)
class Sliced:
    """A sliced sheet, from its grid to its program, with all that a user may want to know of it."""

    sheet: Grid
    lines: Hatch
    result: Result
    plan: Plan
    program: program.Program
    profile: Profile
    facts: dict[str, str]

    def text(self) -> Iterator[str]:
        """The lines of the G-code file."""
        picture = None
        if self.profile.gcode.thumbnail_px is not None:
            from gcode import preview

            picture = preview.thumbnail(self.plan, self.profile.gcode.thumbnail_px)
        return emit.emit(self.program, self.profile, self.facts, thumbnail_png=picture)

    @property
    def room_ul(self) -> float:
        """Volume that the toolpaths have to themselves: length by spacing by width of a bead."""
        length = np.hypot(*(self.plan.toolpaths[:, 1] - self.plan.toolpaths[:, 0]).T)
        col, row = self.lines.tile[self.result.order].T
        return float((length * self.sheet.spacing_mm[row, col]).sum()) * self.profile.material.width_mm

    @property
    def in_file_order_mm(self) -> float:
        """Straight travel of the toolpaths as they stand in the grid, row by row."""
        return travel.straight_mm(self.lines.segments)


def hatched(sheet: Grid) -> Hatch:
    """The toolpaths of a grid.

    Raises:
        SlicerError: there are none.
    """
    lines = hatch.hatch(sheet)
    if len(lines.segments) == 0:
        why = f"{lines.dropped} were shorter than min_length_mm" if lines.dropped else "all tiles are empty"
        raise SlicerError(f"{sheet.source}: no toolpath is left of it: {why}.")
    return lines


def problem_of(segments: NDArray[np.float64], start: str) -> Problem:
    """The sequencing problem: from the "corner", as in the source paper, or with a "free" start.

    The corner is the lower end of toolpath 0, the lowest of the bottom left tile.
    """
    if start == "free":
        return Problem.build(segments)
    return Problem.build(segments, first=0, first_flipped=bool(segments[0, 1, 1] < segments[0, 0, 1]))


def slice_grid(
    grid_file: Path,
    profile_name: str,
    overrides: tuple[str, ...],
    *,
    method: str,
    start: str,
    seed: int,
    step: Callable[[str], None],
) -> Sliced:
    """Turn a grid file into a program; ``step`` is told what begins."""
    profile = profiles.load(profile_name, overrides)
    step("reading")
    sheet = grid.read(grid_file)
    step("hatching")
    lines = hatched(sheet)
    step("sequencing")
    result = sequence.solve(problem_of(lines.segments, start), method=method, seed=seed)
    step("routing")
    clearance = profile.motion.clearance_mm
    plan = travel.plan(lines.segments, result.order, result.flipped, clearance_mm=clearance)
    step("building")
    tile = lines.tile[result.order]
    made = program.build(plan, profile, sheet.spacing_mm[tile[:, 1], tile[:, 0]], tile)
    facts = {
        "version": __version__,
        "grid_sha256": sheet.sha256,
        "profile": profile_name if profile_name in profiles.shipped() else Path(profile_name).name,
        "method": result.method,
        "seed": str(seed),
        "toolpaths": str(len(lines.segments)),
        "travel_straight_mm": f"{plan.straight_mm:.3f}",
        "travel_routed_mm": f"{plan.routed_mm:.3f}",
        "printed_mm": f"{plan.printed_mm:.3f}",
    }
    if overrides:
        facts["settings"] = json.dumps(overrides)
    return Sliced(sheet, lines, result, plan, made, profile, facts)
