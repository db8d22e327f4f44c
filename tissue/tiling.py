"""A field of fibres averaged over square tiles: their tilts, how sure they are, and how true."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.field import Field, anisotropy, axial_difference_deg, coherence, tilt_deg

CELLS_A_TILE = 4
"""Cells are split until a tile is this many of them wide, so that small tiles miss none."""
MOST_SPLITS = 32
MAX_TILES = 1_000_000
FLAT = 1e-6
"""A tile with less than this part of the strongest tile's structure has none."""


@dataclass(frozen=True, eq=False)
class Tiles:
    """What was measured in each tile; row 0 is the bottom row.

    Attributes:
        tilt_deg: float64 (rows, cols), in (-90, 90]; NaN where nothing was measured.
        coherence: float64 (rows, cols), 0 to 1.
        cover: float64 (rows, cols), share of the tile that was measured.
        deviation_deg: float64 (rows, cols), mean axial deviation of the fibres in a tile from its tilt,
            each weighted by its anisotropy; NaN where nothing was measured.
        weight: float64 (rows, cols), the anisotropy that is in a tile, the weight of its deviation.
        off_plane: float64 (rows, cols), mean square of the fibres' component that leaves the plane.
        low: x and y of the lower left corner in the field's unit.
        side: width and height of a tile in the field's unit.
    """

    tilt_deg: NDArray[np.float64]
    coherence: NDArray[np.float64]
    cover: NDArray[np.float64]
    deviation_deg: NDArray[np.float64]
    weight: NDArray[np.float64]
    off_plane: NDArray[np.float64] | None
    low: tuple[float, float]
    side: tuple[float, float]

    def mean_deviation_deg(self, kept: NDArray[np.bool_]) -> float:
        """Mean axial deviation over the kept tiles; NaN if there are none."""
        weight = np.where(kept, self.weight, 0.0)
        total = weight.sum()
        return float(np.nansum(self.deviation_deg * weight) / total) if total > 0 else float("nan")


def extent(field: Field) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right corner of the upright box around a field."""
    corners = field.corners
    return corners.min(axis=0), corners.max(axis=0)


def tile(field: Field, cols: int, rows: int) -> Tiles:
    """Average the tensors of a field over ``cols`` by ``rows`` tiles of the box around it.

    Raises:
        TissueError: there are too many tiles for the cells, or at all.
    """
    if cols * rows > MAX_TILES:
        raise TissueError(f"{cols}x{rows} tiles are {cols * rows}; {MAX_TILES} is the most.")
    low, high = extent(field)
    side = (high - low) / (cols, rows)
    # The lattice may stand at any angle: its steps as they reach along x and y.
    step = np.abs(field.right) + np.abs(field.down)
    splits = int(np.ceil((CELLS_A_TILE * step / side).max() - 1e-9)) if (step > 0).any() else 1
    if splits > MOST_SPLITS:
        finest = np.floor(np.array([cols, rows]) * MOST_SPLITS / splits).astype(int)
        raise TissueError(
            f"{cols}x{rows} tiles are finer than what was measured: a tile is {side[0]:.3g} wide, a cell "
            f"{step[0]:.3g}. Take at most {max(1, finest[0])}x{max(1, finest[1])} tiles."
        )
    count = cols * rows
    sums = np.zeros((6, count))
    area = abs(field.right[0] * field.down[1] - field.right[1] * field.down[0])
    places = [_places(field, low, side, cols, rows, du, dv) for du, dv in _parts(max(1, splits))]
    share = 1 / len(places)
    weight = field.weight.ravel()
    parts = [(field.tensor[k].ravel() * weight) for k in range(3)]
    parts.append(weight)
    if field.off_plane is not None:
        parts.append(field.off_plane.ravel() * weight)
    for place in places:
        for k, part in enumerate(parts):
            sums[k] += np.bincount(place, part, count + 1)[:count]
    tensor = sums[:3].reshape(3, rows, cols)
    cover = (sums[3] * share * area / (side[0] * side[1])).reshape(rows, cols)
    strength = anisotropy(tensor)
    trace = tensor[0] + tensor[1]
    there = (sums[3].reshape(rows, cols) > 0) & (trace > FLAT * max(float(trace.max(initial=0.0)), 1e-300))
    tilt = np.where(there & (strength > 0), tilt_deg(tensor), np.nan)
    deviation, weights = _deviation(field, places, tilt)
    off = None
    if field.off_plane is not None:
        full = sums[3].reshape(rows, cols)
        off = np.divide(sums[4].reshape(rows, cols), full, out=np.zeros_like(full), where=full > 0)
    return Tiles(
        tilt,
        coherence(tensor),
        np.minimum(cover, 1.0),
        deviation,
        weights * share,
        off,
        (float(low[0]), float(low[1])),
        (float(side[0]), float(side[1])),
    )


def _parts(splits: int) -> list[tuple[float, float]]:
    """Where the parts of a split cell stand, as shares of its steps."""
    at = ((np.arange(splits) + 0.5) / splits - 0.5).tolist()
    return [(du, dv) for du in at for dv in at]


def _places(
    field: Field,
    low: NDArray[np.float64],
    side: NDArray[np.float64],
    cols: int,
    rows: int,
    du: float,
    dv: float,
) -> NDArray[np.intp]:
    """Tile of each cell, row by row from the bottom, at a part of the cell."""
    down, right = np.arange(field.weight.shape[0]) + dv, np.arange(field.weight.shape[1]) + du
    at = field.origin - low
    across = (at[0] + down[:, None] * field.down[0] + right * field.right[0]) / side[0]
    up = (at[1] + down[:, None] * field.down[1] + right * field.right[1]) / side[1]
    col = np.clip(np.floor(across).astype(np.intp), 0, cols - 1)
    row = np.clip(np.floor(up).astype(np.intp), 0, rows - 1)
    return np.asarray((row * cols + col).ravel())


def _deviation(
    field: Field, places: list[NDArray[np.intp]], tilt: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean axial deviation of the cells from the tilt of their tile, and the weights of the means."""
    cells = tilt_deg(field.tensor).ravel()
    strength = (anisotropy(field.tensor) * field.weight).ravel()
    flat = tilt.ravel()
    total, weights = np.zeros(flat.size), np.zeros(flat.size)
    for place in places:
        off = np.nan_to_num(axial_difference_deg(cells, flat[place]))
        total += np.bincount(place, off * strength, flat.size)
        weights += np.bincount(place, strength, flat.size)
    mean = np.divide(total, weights, out=np.full(flat.size, np.nan), where=weights > 0)
    return np.where(np.isnan(tilt), np.nan, mean.reshape(tilt.shape)), weights.reshape(tilt.shape)
