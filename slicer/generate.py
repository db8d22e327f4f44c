"""Seeded random fields of fibre angles: the random walk of the source paper."""

import numpy as np

from slicer.errors import SlicerError
from slicer.grid import Grid


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
    _need(cols >= 1 and rows >= 1, f"{cols} columns and {rows} rows: both must be at least 1")
    _need(
        tile_mm > 0 and spacing_mm > 0,
        f"tile {tile_mm:g} mm, spacing {spacing_mm:g} mm: both must be above 0",
    )
    _need(deviation_deg >= 0, f"deviation {deviation_deg:g} must be at least 0 degrees")
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
