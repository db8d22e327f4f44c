"""Whether what is printed fills the area of every tile: a test that knows of no hatch line.

The area of a tile within the outline is the sum over its rows, one every spacing, of what they span times
the spacing. What a row spans is found by Green's theorem: from where the border of the area passes it, and
from nothing else. No line is clipped here, cut or joined, so that a fault of the hatch, which does all of
that, cannot be repeated. It is asked for on both sides of a row, half a nanometre away, of which the fuller
counts: a row on the border of the area, or touched by a corner of it, belongs to the sheet.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from slicer.clip import BORDER_MM, RESOLUTION_MM
from slicer.drawn import DrawnSheet
from slicer.grid import Grid
from slicer.hatch import directions
from slicer.outline import area_of

OFF_ROW_MM = 3 * RESOLUTION_MM
"""How far from its row a printed line may lie: half the resolution each for its end and the sheet's place,
and as much as a tilt may leave the level over a tile."""

SLACK_MM = 5 * RESOLUTION_MM
"""What rounding may take from a printed line: the resolution at both ends, in both coordinates, in what is
written and in what is hatched."""


class Short(NamedTuple):
    """A tile whose rows are not printed in full.

    Attributes:
        col, row: the tile.
        rows: how many of its rows are short.
        printed_mm, needed_mm: the length of what is printed in them, and the least that must be.
        x_mm, y_mm: where the shortest one passes by the tile's centre, in the grid's frame.
    """

    col: int
    row: int
    rows: int
    printed_mm: float
    needed_mm: float
    x_mm: float
    y_mm: float


class _Tiles(NamedTuple):
    col: NDArray[np.int64]
    row: NDArray[np.int64]
    centre: NDArray[np.float64]
    along: NDArray[np.float64]
    spacing: NDArray[np.float64]
    most: NDArray[np.int64]  # rows on either side, with one to spare
    first: NDArray[np.int64]  # number of the lowest row, in the count over all tiles


def shortfalls(lines: NDArray[np.float64], grid: Grid) -> list[Short]:
    """The tiles in which less is printed than their area needs.

    A row that the outline leaves in n pieces, c mm in all, must be printed over c mm, but for the pieces
    that are shorter than ``min_length_mm`` (m) and are dropped: n - 1 of them at most where c > n m, and
    all otherwise. Rounding takes ``SLACK_MM`` for each piece. What is shorter than that is not seen.

    Args:
        lines: float64 (n, 2, 2), what is printed, in the grid's frame.
    """
    if isinstance(grid, DrawnSheet):  # own toolpaths fill no area
        return [
            short._replace(col=k, row=0)
            for k, part in enumerate(grid.parts)
            for short in shortfalls(lines, part)
        ]
    tiles = _tiles(grid)
    if len(tiles.col) == 0:
        return []
    printed = _printed(lines, grid, tiles)
    least = np.full(len(tiles.col), grid.min_length_mm) if grid.min_length_mm is not None else tiles.spacing
    shortest = np.repeat(np.maximum(least, 2 * RESOLUTION_MM), 2 * tiles.most + 1)
    tile, sides = _borders(grid, tiles)
    needed = np.zeros(len(printed))
    for away in (-BORDER_MM / 2, BORDER_MM / 2):
        span, pieces = _spans(tile, sides, tiles, away, len(printed))
        certain = span - (pieces - 1) * shortest - pieces * SLACK_MM
        needed = np.maximum(needed, np.where(span > pieces * (shortest + SLACK_MM), certain, 0.0))
    return list(_short(printed, needed, tiles))


def _tiles(grid: Grid) -> _Tiles:
    row, col = np.nonzero(~np.isnan(grid.angles_deg))
    side = np.array(grid.tile_mm)
    centre = np.array(grid.origin_mm) + (np.stack([col, row], axis=1) + 0.5) * side
    spacing = grid.spacing_mm[row, col]
    diagonal = float(np.hypot(*side))
    most = np.ceil(diagonal / 2 / spacing).astype(np.int64) + 1
    first = np.cumsum(2 * most + 1) - (2 * most + 1)
    return _Tiles(col, row, centre, directions(grid.angles_deg[row, col], diagonal), spacing, most, first)


def _printed(lines: NDArray[np.float64], grid: Grid, tiles: _Tiles) -> NDArray[np.float64]:
    """What is printed along each row, in mm; a line on the border of two tiles counts for both."""
    number = np.full(grid.angles_deg.shape, -1, np.int64)
    number[tiles.row, tiles.col] = np.arange(len(tiles.col))
    middle = (lines.mean(axis=1) - grid.origin_mm) / grid.tile_mm
    reach = OFF_ROW_MM / np.array(grid.tile_mm)
    pairs = []
    for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        col, row = np.floor(middle + np.array(corner) * reach).astype(np.int64).T
        there = (col >= 0) & (row >= 0) & (col < grid.cols) & (row < grid.rows)
        pairs.append(np.stack([np.flatnonzero(there), number[row[there], col[there]]], axis=1))
    line, tile = np.unique(np.concatenate(pairs), axis=0).T
    line, tile = line[tile >= 0], tile[tile >= 0]
    _, off = _in_frame(lines[line], tile, tiles)
    step = np.round(off.mean(axis=1) / tiles.spacing[tile])
    near = np.abs(off - (step * tiles.spacing[tile])[:, None]).max(axis=1, initial=0.0) <= OFF_ROW_MM
    near &= np.abs(step) <= tiles.most[tile]
    line, tile, step = line[near], tile[near], step[near].astype(np.int64)
    length = np.hypot(*(lines[line, 1] - lines[line, 0]).T)
    total = np.zeros(int((2 * tiles.most + 1).sum()))
    np.add.at(total, tiles.first[tile] + tiles.most[tile] + step, length)
    return total


def _borders(grid: Grid, tiles: _Tiles) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The sides of the area of each tile within the outline: the tile of each, and float64 (m, 2, 2)."""
    number = np.full(grid.angles_deg.shape, -1, np.int64)
    number[tiles.row, tiles.col] = np.arange(len(tiles.col))
    x = grid.origin_mm[0] + np.arange(grid.cols + 1, dtype=np.float64) * grid.tile_mm[0]
    y = grid.origin_mm[1] + np.arange(grid.rows + 1, dtype=np.float64) * grid.tile_mm[1]
    whole = shapely.box(x[0], y[0], x[-1], y[-1])
    area = whole if grid.outline_mm is None else shapely.intersection(area_of(grid.outline_mm), whole)
    owner, sides = [np.empty(0, np.int64)], [np.empty((0, 2, 2))]
    for part, (low_col, high_col, low_row, high_row) in _quartered(area, x, y, (0, grid.cols, 0, grid.rows)):
        block = number[low_row:high_row, low_col:high_col]
        row, col = np.nonzero(block >= 0)
        mine, row, col = block[row, col], row + low_row, col + low_col
        if part is None:
            corners = np.stack([x[col], y[row], x[col + 1], y[row + 1]], axis=1)
            ring = corners[:, [[0, 1], [2, 1], [2, 3], [0, 3], [0, 1]]]
            found = np.stack([ring[:, :-1], ring[:, 1:]], axis=2).reshape(-1, 2, 2)
            owner.append(np.repeat(mine, 4))
        elif len(mine):
            xy, ring_of = shapely.get_coordinates(
                shapely.get_rings(shapely.get_parts(part)), return_index=True
            )
            found = np.stack([xy[:-1], xy[1:]], axis=1)[ring_of[1:] == ring_of[:-1]]
            owner.append(np.full(len(found), mine[0]))
        else:
            continue
        sides.append(found)
    return np.concatenate(owner), np.concatenate(sides)


def _quartered(
    area: shapely.Geometry,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    block: tuple[int, int, int, int],
) -> Iterator[tuple[shapely.Geometry | None, tuple[int, int, int, int]]]:
    """An area cut along tiles: (None, block) where it fills a block of them, else (its part, one tile).

    Halved again and again, so that an outline of many corners is not cut whole for each tile.
    """
    low_col, high_col, low_row, high_row = block
    if shapely.area(area) == 0:
        return
    box = shapely.box(x[low_col], y[low_row], x[high_col], y[high_row])
    if shapely.get_num_coordinates(area) == 5 and shapely.equals(area, box):
        yield None, block
        return
    if high_col - low_col == 1 and high_row - low_row == 1:
        yield _areas_of(area), block
        return
    if high_col - low_col >= high_row - low_row:
        cut = (low_col + high_col) // 2
        halves = [(low_col, cut, low_row, high_row), (cut, high_col, low_row, high_row)]
    else:
        cut = (low_row + high_row) // 2
        halves = [(low_col, high_col, low_row, cut), (low_col, high_col, cut, high_row)]
    for half in halves:
        bounds = shapely.box(x[half[0]], y[half[2]], x[half[1]], y[half[3]])
        yield from _quartered(_areas_of(shapely.intersection(area, bounds)), x, y, half)


def _areas_of(found: shapely.Geometry) -> shapely.Geometry:
    """An area without the lines and points of a border that it merely touches."""
    parts = shapely.get_parts(found)
    areas = parts[shapely.get_dimensions(parts) == 2]
    return areas[0] if len(areas) == 1 else shapely.multipolygons(areas)


def _in_frame(
    ends: NDArray[np.float64], tile: NDArray[np.int64], tiles: _Tiles
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (n, 2, 2) from the centre of their tile: how far along its rows (n, 2), and across them."""
    from_centre = ends - tiles.centre[tile][:, None]
    along = tiles.along[tile]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return (from_centre * along[:, None]).sum(axis=2), (from_centre * across[:, None]).sum(axis=2)


def _spans(
    tile: NDArray[np.int64], sides: NDArray[np.float64], tiles: _Tiles, away_mm: float, rows: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """How much of each row lies in the area, ``away_mm`` beside it, and in how many pieces.

    A row enters and leaves the area by turns; a corner counts for the side above it alone.
    """
    t, off = _in_frame(sides, tile, tiles)
    spacing = tiles.spacing[tile]
    reach = (off - away_mm) / spacing[:, None]
    lowest, highest = np.ceil(reach.min(axis=1)), np.ceil(reach.max(axis=1)) - 1
    counts = np.maximum(highest - lowest + 1, 0).astype(np.int64)
    side = np.repeat(np.arange(len(sides)), counts)
    step = lowest[side] + np.arange(len(side)) - np.repeat(np.cumsum(counts) - counts, counts)
    part = (step * spacing[side] + away_mm - off[side, 0]) / (off[side, 1] - off[side, 0])
    place = t[side, 0] + np.clip(part, 0, 1) * (t[side, 1] - t[side, 0])
    row = (tiles.first + tiles.most)[tile[side]] + step.astype(np.int64)
    sequence = np.lexsort((place, row))
    place, row = place[sequence], row[sequence]
    leaves = np.arange(len(row)) % 2 == 1  # rings are closed: every row is passed an even number of times
    span = np.zeros(rows)
    np.add.at(span, row, np.where(leaves, place, -place))
    return span, np.bincount(row, minlength=rows) // 2


def _short(printed: NDArray[np.float64], needed: NDArray[np.float64], tiles: _Tiles) -> Iterator[Short]:
    short = np.flatnonzero(printed < needed)
    of = np.searchsorted(tiles.first, short, side="right") - 1
    for tile in np.unique(of):
        mine = short[of == tile]
        worst = mine[np.argmax(needed[mine] - printed[mine])]
        step = (worst - tiles.first[tile] - tiles.most[tile]) * tiles.spacing[tile]
        along_x, along_y = tiles.along[tile]
        x, y = tiles.centre[tile] + step * np.array([-along_y, along_x])
        sums = float(printed[mine].sum()), float(needed[mine].sum())
        yield Short(int(tiles.col[tile]), int(tiles.row[tile]), len(mine), *sums, float(x), float(y))
