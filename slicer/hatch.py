"""Parallel lines in every tile at its tilt, clipped to tile and outline: the toolpaths."""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from slicer.clip import RESOLUTION_MM, Rows, TooManyCrossingsError, clip
from slicer.drawn import DrawnSheet, with_first_printable
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.outline import area_of

MAX_LINES = 5_000_000

RELATIVE_EPS = 1e-9
"""Lengths that differ by less than this part of a tile's side are the same."""


@dataclass(frozen=True, eq=False)
class Hatch:
    """The toolpaths of a sheet.

    They stand row by row from the bottom, in a row tile by tile from the left, in a tile from the lowest
    line to the highest: in this order they can be printed. Toolpath 0 is thus the lowest of the bottom
    left tile.

    Attributes:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        tile: int32 (n, 2), (col, row) of each toolpath.
        dropped: how many were too short.
    """

    segments: NDArray[np.float64]
    tile: NDArray[np.int32]
    dropped: int


def hatch(grid: Grid) -> Hatch:
    """Lines at each tile's tilt, through its centre and every spacing to either side.

    A line on the border of two tiles that both have it belongs to the lower or the left one. The outline's
    border belongs to the sheet: what runs along it or is touched by it is whole.

    Raises:
        SlicerError: the spacing is so small that there would be more than ``MAX_LINES`` lines, or the
            outline crosses them too often.
    """
    if isinstance(grid, DrawnSheet):
        return _drawn(grid)
    row, col = np.nonzero(~np.isnan(grid.angles_deg))
    width, height = grid.tile_mm
    along = directions(grid.angles_deg[row, col], float(np.hypot(width, height)))
    spacing = grid.spacing_mm[row, col]
    # How far from the centre, across the lines, a tile reaches, and thus how many lines it takes.
    reach = (width * np.abs(along[:, 1]) + height * along[:, 0]) / 2
    each_side = np.floor(reach / spacing * (1 + RELATIVE_EPS))
    total = float((2 * each_side + 1).sum())
    if total > MAX_LINES:
        k = int(each_side.argmax())
        raise SlicerError(
            f"{grid.source}: tile ({col[k]}, {row[k]}) alone takes {2 * each_side[k] + 1:.3g} lines at "
            f"spacing {spacing[k]:g} mm, the sheet {total:.3g}; {MAX_LINES} is the most. Raise spacing_mm."
        )
    counts = (2 * each_side + 1).astype(np.int64)
    of = np.repeat(np.arange(len(row)), counts)  # the tile of each line
    step = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts) - each_side[of]
    low = np.asarray(grid.origin_mm) + np.stack([col * width, row * height], axis=1)
    # The sums are formed as a neighbour forms them, so that borders agree to the last bit.
    high = np.asarray(grid.origin_mm) + np.stack([(col + 1) * width, (row + 1) * height], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    middle = ((low + high) / 2)[of] + across[of] * (step * spacing[of])[:, None]
    _snap_to_borders(middle, along[of], low[of], high[of])
    span = along[of] * np.hypot(width, height)
    lines = shapely.linestrings(np.stack([middle - span, middle + span], axis=1))
    clipped = shapely.intersection(lines, shapely.box(*low[of].T, *high[of].T))
    owner = np.flatnonzero(
        (shapely.get_type_id(clipped) == shapely.GeometryType.LINESTRING) & ~shapely.is_empty(clipped)
    )
    ends = _in_direction(shapely.get_coordinates(clipped[owner]).reshape(-1, 2, 2), along[of[owner]])
    if grid.outline_mm is not None:
        first = (np.cumsum(counts) - counts).astype(np.intp)
        rows = Rows((low + high) / 2, along, spacing, each_side, first, shapely.box(*low.T, *high.T))
        try:
            ends, which = clip(ends, owner, along[of[owner]], rows, area_of(grid.outline_mm))
        except TooManyCrossingsError as error:
            raise SlicerError(f"{grid.source}: outline_mm {error}.") from None
        owner = owner[which]
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    shortest = np.full(len(row), grid.min_length_mm) if grid.min_length_mm is not None else spacing
    # Points are lines that meet only a corner of their tile; they are no toolpaths at all.
    real = length > RELATIVE_EPS * max(grid.tile_mm)
    enough = np.maximum(shortest[of[owner]] * (1 - RELATIVE_EPS), 2 * RESOLUTION_MM)
    keep = real & (length >= enough)
    straight_up_or_level = (along[of[owner]] == 0).any(axis=1)
    once = _once_on_borders(ends, keep & straight_up_or_level, max(grid.tile_mm))
    tile = np.stack([col, row], axis=1).astype(np.int32)
    return Hatch(ends[once & keep], tile[of[owner[once & keep]]], int((once & real & ~keep).sum()))


def _drawn(sheet: DrawnSheet) -> Hatch:
    """The toolpaths of a sheet without tiles, its own or its regions'; nothing lies below the first."""
    if not sheet.parts:
        return Hatch(sheet.segments, np.stack([sheet.group, np.zeros_like(sheet.group)], axis=1), 0)
    filled = [hatch(part) for part in sheet.parts]
    segments = np.concatenate([lines.segments for lines in filled])
    region = np.repeat(np.arange(len(filled), dtype=np.int32), [len(lines.segments) for lines in filled])
    order = with_first_printable(segments) if len(segments) else np.empty(0, np.intp)
    tile = np.stack([region, np.zeros_like(region)], axis=1)[order]
    return Hatch(segments[order], tile, sum(lines.dropped for lines in filled))


def directions(angles_deg: NDArray[np.float64], diagonal_mm: float) -> NDArray[np.float64]:
    """Unit vectors (t, 2) of tilts.

    A tilt that leaves 0 or 90 degrees by less than a program can say over a whole tile is 0 or 90:
    measured angles are seldom exact, and lines that differ by nothing must not be two.
    """
    radians = np.radians(angles_deg)
    along = np.stack([np.cos(radians), np.sin(radians)], axis=1)
    along[np.abs(along[:, 1]) * diagonal_mm <= RESOLUTION_MM] = 1.0, 0.0
    along[np.abs(along[:, 0]) * diagonal_mm <= RESOLUTION_MM] = 0.0, 1.0
    return along


def _snap_to_borders(
    middle: NDArray[np.float64],
    along: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> None:
    """Put lines that run along a border of their tile, but for rounding, exactly on it."""
    for axis in range(2):
        level = along[:, axis] == 0
        for border in (low, high):
            near = level & (np.abs(middle - border)[:, axis] <= RELATIVE_EPS * (high - low)[:, axis])
            middle[near, axis] = border[near, axis]


def _in_direction(ends: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Let every line run in its tile's direction."""
    backwards = ((ends[:, 1] - ends[:, 0]) * along).sum(axis=1) < 0
    return np.where(backwards[:, None, None], ends[:, ::-1], ends)


def _once_on_borders(
    ends: NDArray[np.float64], candidates: NDArray[np.bool_], side_mm: float
) -> NDArray[np.bool_]:
    """True for all but the later one of two toolpaths that lie on the same border of two tiles."""
    once = np.ones(len(ends), np.bool_)
    those = np.flatnonzero(candidates)
    digits = np.round(ends[those].reshape(-1, 4) / (RELATIVE_EPS * side_mm))
    _, first = np.unique(digits, axis=0, return_index=True)
    once[those] = False
    once[those[first]] = True
    return once
