"""The sheets that searches are measured on, and what a machine and its nozzle make of them."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import profiles
from profiles.nozzles import nozzle_called
from slicer import grid
from slicer.generate import random_walk
from slicer.grid import Grid
from slicer.hatch import Hatch, hatch
from slicer.sequence import Problem
from slicer.sequence.problem import Objective, ObjectiveName
from vslice.nozzle import body_of
from vslice.objective import join_mm, objective_of
from vslice.printable import counted_join_mm, printable

ROOT = Path(__file__).parents[1]


class Sheet(NamedTuple):
    """Toolpaths as they are hatched.

    Attributes:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        spacing_mm: float64 (n,), of each toolpath.
        tile_mm: width of a tile.
        first: the toolpath to begin with; None for any.
    """

    segments: NDArray[np.float64]
    spacing_mm: NDArray[np.float64]
    tile_mm: float
    first: int | None

    def scaled(self, tile_mm: float) -> "Sheet":
        """The same sheet with tiles of another width, all else in proportion."""
        by = tile_mm / self.tile_mm
        return Sheet(self.segments * by, self.spacing_mm * by, tile_mm, self.first)

    @property
    def problem(self) -> Problem:
        """Its problem for a nozzle that is a point."""
        return Problem.build(self.segments, first=self.first)


class Setting(NamedTuple):
    """What is minimised on which machine.

    Attributes:
        objective: its name.
        profile: whose machine it is.
        nozzle: the name of the nozzle on it; None for a point.
        tile_mm: width of a tile; None as the sheets have it.
    """

    objective: ObjectiveName = "straight"
    profile: str = "paper"
    nozzle: str | None = None
    tile_mm: float | None = None


class Instance(NamedTuple):
    """A problem and what is minimised.

    Attributes:
        downhill_deg: the steepest tilt at which the problem lets a toolpath be printed downwards.
    """

    problem: Problem
    objective: Objective
    downhill_deg: float = 90.0


def instance_of(sheet: Sheet, setting: Setting) -> Instance:
    """What a machine makes of a sheet: with a nozzle the problem that ``vslice slice`` orders.

    Raises:
        ProfileError: there is no such profile or nozzle.
        SlicerError: toolpaths stand in each other's way and cannot be cut.
    """
    if setting.tile_mm is not None:
        sheet = sheet.scaled(setting.tile_mm)
    if setting.nozzle is None:
        return Instance(sheet.problem, objective_of(profiles.load(setting.profile), setting.objective))
    profile = profiles.load(setting.profile, tuple(nozzle_called(setting.nozzle).settings()))
    nozzle = profile.nozzle
    # Which tile a toolpath is of is only said in errors.
    lines = Hatch(sheet.segments, np.zeros((len(sheet.segments), 2), np.int32), 0)
    shaped = printable(
        "sheet",
        lines,
        "free" if sheet.first is None else "corner",
        body_of(profile, sheet.spacing_mm),
        nozzle.downhill_deg,
        overlap_mm=nozzle.overlap_mm,
    )
    join = counted_join_mm(join_mm(profile, sheet.spacing_mm), shaped.ends)
    return Instance(shaped.problem, objective_of(profile, setting.objective, join), nozzle.downhill_deg)


def sheets(sizes: list[int], walks: list[tuple[int, int, int]]) -> dict[str, Callable[[], Sheet]]:
    """How to make each sheet, by its name; reference sheets and walks begin with their first toolpath."""
    made: dict[str, Callable[[], Sheet]] = {}
    for file in sorted((ROOT / "tests" / "data" / "reference").glob("*_s1.json")):
        made[file.stem] = partial(reference, file)
    for file in sorted((ROOT / "tests" / "data" / "tissue").glob("*.json")):
        made[file.stem] = partial(tissue, file)
    for size in sizes:
        made[f"{size}x{size}"] = partial(walk, size, size, 1)
    for cols, rows, count in walks:
        for seed in range(1, count + 1):
            made[walk_name(cols, rows, seed)] = partial(walk, cols, rows, seed)
    return made


def reference(file: Path) -> Sheet:
    """A reference instance."""
    data = json.loads(file.read_text(encoding="utf-8"))
    segments = np.array(data["segments"], float)
    return Sheet(segments, np.full(len(segments), data["spacing"]), data["tile"], data["first"])


def tissue(file: Path) -> Sheet:
    """A grid file, to be begun wherever is best."""
    return _hatched(grid.read(file), None)


def walk(cols: int, rows: int, seed: int) -> Sheet:
    """A random walk, from its lowest toolpath on the left."""
    return _hatched(random_walk(cols, rows, seed=seed), 0)


def walk_name(cols: int, rows: int, seed: int) -> str:
    """What a random walk is called in the tables."""
    return f"walk {cols}x{rows} seed {seed}"


def _hatched(field: Grid, first: int | None) -> Sheet:
    lines = hatch(field)
    col, row = lines.tile.T
    return Sheet(lines.segments, field.spacing_mm[row, col], field.tile_mm[0], first)
