"""Seeded random fields of fibre angles: the random walk of the source paper."""

import math

import numpy as np

from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.grid_schema import LEAST_MM, MOST_MM, REACH_MM

MAX_TILES = 1_000_000
MAX_SEED = 2**63 - 1


def random_walk(
    cols: int,
    rows: int,
    *,
    seed: int,
    tile_mm: float = 1.0,
    spacing_mm: float = 0.1,
    start_deg: float = -45.0,
    deviation_deg: float = 22.5,
    low_deg: float = -45.0,
    high_deg: float = 0.0,
) -> Grid:
    """A field in which each tile resembles those to its left and below (paper, section 4).

    The bottom left tile has ``start_deg``. Every other one is the mean of its left and its lower
    neighbour, or the one that exists, plus a uniform deviation of up to ``deviation_deg`` either way;
    what leaves [low_deg, high_deg] is reflected at the limits until it is inside.

    Args:
        cols, rows: number of tiles.
        seed: the same seed gives the same field.
        tile_mm, spacing_mm: as in a grid file.

    Raises:
        SlicerError: a number is out of range; it names the number and the range.
    """
    numbers = (tile_mm, spacing_mm, start_deg, deviation_deg, low_deg, high_deg)
    _need(all(map(math.isfinite, numbers)), f"{', '.join(map(str, numbers))}: every number must be finite")
    _need(cols >= 1 and rows >= 1, f"{cols} columns and {rows} rows: both must be at least 1")
    _need(
        cols * rows <= MAX_TILES,
        f"{cols} columns and {rows} rows are {cols * rows} tiles; {MAX_TILES} is the most",
    )
    shown = str(seed) if seed.bit_length() < 100 else f"of {seed.bit_length()} bits"
    _need(0 <= seed <= MAX_SEED, f"seed {shown}: must be from 0 to {MAX_SEED}")
    for name, value in (("tile", tile_mm), ("spacing", spacing_mm)):
        _need(
            LEAST_MM <= value <= MOST_MM, f"{name} {value:g} mm: must be from {LEAST_MM:g} to {MOST_MM:g} mm"
        )
    longest = max(cols, rows) * tile_mm
    _need(longest <= REACH_MM, f"the sheet is {longest:g} mm long; {REACH_MM:g} mm is the most")
    _need(0 <= deviation_deg <= 180, f"deviation {deviation_deg:g}: must be from 0 to 180 degrees")
    _need(
        -90 < low_deg <= start_deg <= high_deg <= 90,
        f"low {low_deg:g}, start {start_deg:g}, high {high_deg:g}: must ascend within (-90, 90] degrees",
    )
    random = np.random.default_rng(seed)
    angles = np.empty((rows, cols))
    for row in range(rows):
        for col in range(cols):
            near = [angles[r, c] for r, c in ((row, col - 1), (row - 1, col)) if r >= 0 and c >= 0]
            if not near:
                angles[row, col] = start_deg
                continue
            angle = sum(near) / len(near) + random.uniform(-deviation_deg, deviation_deg)
            angles[row, col] = reflect(angle, low_deg, high_deg)
    meta = {
        "generator": "random walk",
        "seed": seed,
        "start_deg": start_deg,
        "deviation_deg": deviation_deg,
        "range_deg": [low_deg, high_deg],
    }
    return Grid(
        angles, np.full((rows, cols), spacing_mm), (tile_mm, tile_mm), meta=meta, source=f"seed {seed}"
    )


def reflect(value: float, low: float, high: float) -> float:
    """Fold a number into [low, high], as if its ends were mirrors."""
    width = high - low
    if width == 0:
        return low
    off = (value - low) % (2 * width)
    return low + (off if off <= width else 2 * width - off)


def _need(condition: bool, message: str) -> None:
    if not condition:
        raise SlicerError(f"random walk: {message}")
