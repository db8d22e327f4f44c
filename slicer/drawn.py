"""Sheets that are drawn instead of tiled: toolpaths of one's own, and regions each with an angle.

They are grids to all who use one, with a tile (k, 0) for each region, or for each spacing of own toolpaths.
"""

from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from slicer.errors import GridError
from slicer.grid import Grid
from slicer.grid_schema import REACH_MM
from slicer.outline import NoAreaError, Ring, area_of, repair
from slicer.tilts import fold

DEFAULT_SPACING_MM = 0.4
"""Where a file does not say it; the height of a bead follows from it."""
LEAST_OVERLAP_MM2 = 1e-6
EPS_MM = 1e-9


@dataclass(frozen=True, eq=False)
class DrawnSheet(Grid):
    """A sheet whose toolpaths do not come from a lattice of tiles.

    Attributes:
        parts: of a sheet of regions, a grid of one tile for each, clipped to the region.
        segments: float64 (n, 2, 2), the toolpaths in mm of a sheet that gives them itself.
        group: int32 (n,), which column of ``spacing_mm`` each of those has.
    """

    parts: tuple[Grid, ...] = ()
    segments: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2, 2)))
    group: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))


@dataclass(frozen=True)
class Region:
    """An area that is filled at one tilt: its polygons, each the outer ring and then its holes, in mm."""

    polygons: list[list[Ring]]
    angle_deg: float
    spacing_mm: float


def sheet_of_segments(
    segments: NDArray[np.float64],
    spacing_mm: NDArray[np.float64],
    *,
    source: str,
    warnings: tuple[str, ...] = (),
) -> DrawnSheet:
    """A sheet of own toolpaths.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        spacing_mm: float64 (n,), how far each is from its neighbours.
    """
    order = with_first_printable(segments)
    values, group = np.unique(spacing_mm[order], return_inverse=True)
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    return DrawnSheet(
        np.zeros((1, len(values))),
        values[None],
        (float(max(high[0] - low[0], EPS_MM)), float(max(high[1] - low[1], EPS_MM))),
        (float(low[0]), float(low[1])),
        source=source,
        warnings=warnings,
        segments=np.ascontiguousarray(segments[order]),
        group=group.astype(np.int32),
    )


def sheet_of_regions(regions: list[Region], *, min_length_mm: float | None, source: str) -> DrawnSheet:
    """A sheet of regions, each filled with as many lines as its spacing has room for, centred.

    No line lies on the outermost border of a region, so neighbours share none.

    Raises:
        GridError: a region has no area, or two overlap.
    """
    angles, warnings = fold(np.array([[region.angle_deg for region in regions]]))
    parts, areas = [], []
    for k, region in enumerate(regions):
        try:
            polygons, repaired = repair(region.polygons)
        except NoAreaError as error:
            raise GridError(source, [f"region {k}: {error}"]) from None
        warnings += [f"region {k}: {line}." for line in repaired[:3]]
        areas.append(area_of(polygons))
        tilt = float(angles[0, k])
        parts.append(_part(polygons, areas[-1], tilt, region.spacing_mm, min_length_mm, source))
    _refuse_overlaps(areas, source)
    low_x, low_y, high_x, high_y = shapely.total_bounds(np.array(areas)).tolist()
    return DrawnSheet(
        angles,
        np.array([[region.spacing_mm for region in regions]]),
        (high_x - low_x, high_y - low_y),
        (low_x, low_y),
        min_length_mm=min_length_mm,
        source=source,
        warnings=tuple(f"{source}: {line}" for line in warnings),
        parts=tuple(parts),
    )


def _part(
    polygons: list[list[Ring]],
    area: shapely.Geometry,
    tilt: float,
    spacing: float,
    min_length_mm: float | None,
    source: str,
) -> Grid:
    """A grid of one tile around a region, its centre on one of the lines: every other one follows from it."""
    across = np.array([-np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    corners = shapely.get_coordinates(area)
    away = corners @ across
    low, high = float(away.min()), float(away.max())
    count = max(1, int(np.floor((high - low) / spacing * (1 + 1e-9))))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    first = (low + high) / 2 - (count - 1) / 2 * spacing
    nearest = first + np.clip(np.round((middle @ across - first) / spacing), 0, count - 1) * spacing
    centre = middle + (nearest - middle @ across) * across
    half = np.abs(corners - centre).max(axis=0) + spacing / 2
    return Grid(
        np.array([[tilt]]),
        np.array([[spacing]]),
        (2 * float(half[0]), 2 * float(half[1])),
        (float(centre[0] - half[0]), float(centre[1] - half[1])),
        polygons,
        min_length_mm,
        source=source,
    )


def _refuse_overlaps(areas: list[shapely.Geometry], source: str) -> None:
    tree = shapely.STRtree(areas)
    one, other = tree.query(areas, predicate="intersects")
    problems = []
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        if a < b and (shared := shapely.intersection(areas[a], areas[b]).area) > LEAST_OVERLAP_MM2:
            problems.append(f"regions {a} and {b} overlap by {shared:.3g} mm²; no place can be filled twice.")
    if problems:
        raise GridError(source, problems)


def with_first_printable(segments: NDArray[np.float64]) -> NDArray[np.intp]:
    """An order of toolpaths whose first one has nothing below it, the rest as they stand."""
    first = _with_nothing_below(segments)
    return np.concatenate([[first], np.delete(np.arange(len(segments)), first)])


def _with_nothing_below(segments: NDArray[np.float64]) -> int:
    """The number of a toolpath that nothing lies below, at the left: from the lowest left one down to it."""
    if len(segments) == 0:
        return 0
    swap = segments[:, 0, 0] > segments[:, 1, 0]
    lines = np.where(swap[:, None, None], segments[:, ::-1], segments)
    x0, y0, x1, y1 = lines.reshape(-1, 4).T
    k = int(np.lexsort((np.minimum(y0, y1), x0))[0])
    for _ in range(len(lines)):
        low, high = np.maximum(x0, x0[k]), np.minimum(x1, x1[k])
        upright = (x1 - x0 <= EPS_MM) | (x1[k] - x0[k] <= EPS_MM)
        shared = (high - low > EPS_MM) | (upright & (high >= low - EPS_MM))
        at = (low + high) / 2
        below = shared & (_height(x0, y0, x1, y1, at) < _height(x0[k], y0[k], x1[k], y1[k], at) - EPS_MM)
        below[k] = False
        if not below.any():
            break
        k = int(np.flatnonzero(below)[0])
    return k


def _height(
    x0: NDArray[np.float64],
    y0: NDArray[np.float64],
    x1: NDArray[np.float64],
    y1: NDArray[np.float64],
    at: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Height of lines at x; that of an upright one is its lower end."""
    wide = x1 - x0
    upright = wide <= EPS_MM
    slope = np.where(upright, 0.0, (y1 - y0) / np.where(upright, 1.0, wide))
    return np.asarray(np.where(upright, np.minimum(y0, y1), y0 + slope * (at - x0)))


def in_reach(value: object) -> bool:
    """Whether something is a number that a coordinate may be."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= REACH_MM
