"""From a measurement to a grid of fibre angles, with a record of how it came about."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slicer import grid
from slicer.grid import Grid
from tissue import mask, turning
from tissue.errors import TissueError
from tissue.field import Field
from tissue.layout import Division, divide
from tissue.measurement import Measurement
from tissue.settings import Layout
from tissue.tiling import Tiles, extent, tile

DOUBTFUL = 0.1
"""Tiles of less coherence have hardly a direction."""
CONVENTION = (
    "degrees counter-clockwise from +x, y up, in (-90, 90]; angles_deg[row][col], row 0 = bottom; axial, so "
    "averaged as tensors"
)


@dataclass(frozen=True, eq=False)
class Oriented:
    """A sheet that was measured.

    Attributes:
        sheet: its grid; tiles that do not count are NaN.
        tiles: what was measured in each tile.
        field: the fibres, turned as the sheet is, in the field's unit.
        scale_mm: what that unit is on the sheet.
        said: what was assumed or decided, a line each.
    """

    sheet: Grid
    tiles: Tiles
    field: Field
    scale_mm: float
    said: tuple[str, ...]

    @property
    def kept(self) -> NDArray[np.bool_]:
        """bool (rows, cols), the tiles that are printed."""
        return ~np.isnan(self.sheet.angles_deg)

    @property
    def deviation_deg(self) -> float:
        """Mean axial deviation of the fibres from the angle of their tile."""
        return self.tiles.mean_deviation_deg(self.kept)

    @property
    def off_plane_deg(self) -> float | None:
        """Root mean square angle between fibres and plane; None for an image."""
        if self.tiles.off_plane is None:
            return None
        return float(np.degrees(np.arcsin(np.sqrt(min(1.0, self.tiles.off_plane[self.kept].mean())))))


def orient(measured: Measurement, layout: Layout) -> Oriented:
    """Tile what was measured.

    Raises:
        TissueError: nothing is left, or the layout has no answer.
        GridError: the sheet is larger or finer than a grid may be.
    """
    said: list[str] = []
    field, turn = _turned(measured.field, layout, said)
    low, high = extent(field)
    width, height = (high - low).tolist()
    division = divide(width, height, measured.unit_mm, layout, measured.source)
    tiles = tile(field, division.cols, division.rows)
    angles, dropped = _angles(tiles, layout, measured.source)
    if dropped:
        said.append(f"{dropped} of {angles.size} tiles are empty: outside, or without a direction")
    doubtful = int((tiles.coherence[~np.isnan(angles)] < DOUBTFUL).sum())
    if doubtful:
        tiles_have = "tile has" if doubtful == 1 else "tiles have"
        said.append(
            f"{doubtful} {tiles_have} a coherence below {DOUBTFUL:g} and so hardly a direction; "
            f"--min-coherence {DOUBTFUL:g} leaves them empty"
        )
    tile_mm = (round(tiles.side[0] * division.scale_mm, 6), round(tiles.side[1] * division.scale_mm, 6))
    if layout.spacing_mm > min(tile_mm) / 2:
        said.append(
            f"few toolpaths {layout.spacing_mm:g} mm apart fit tiles of {tile_mm[0]:g}x{tile_mm[1]:g} mm: "
            "a smaller --spacing-mm or fewer tiles show more"
        )
    outline = None
    if layout.outline:
        outline = _outline(field, tiles, division, measured.source)
    sheet = Grid(
        np.round(angles, 3) + 0.0,
        np.full(angles.shape, layout.spacing_mm),
        tile_mm,
        outline_mm=outline,
        meta=_meta(measured, layout, tiles, angles, turn, division),
        source=measured.source,
    )
    # As a reader of the file will have it, with all that is checked there.
    sheet = replace(grid.loads(grid.dumps(sheet), source=measured.source), warnings=())
    return Oriented(sheet, tiles, field, division.scale_mm, tuple(said))


def _turned(field: Field, layout: Layout, said: list[str]) -> tuple[Field, float]:
    """The field flipped and turned, and by how much."""
    if layout.flip is not None:
        field = field.mirrored(layout.flip)
    limit = layout.max_tilt_deg
    if layout.turn == "best" or (layout.turn is None and limit is not None):
        turn = turning.best_turn(field, limit)
        if turn == 0:
            said.append("not turned: no turn makes its fibres flatter by a degree")
            return field, 0.0
        turned = field.turned(turn)
        gain = f"turned by {turn:g}°: mean tilt {turning.mean_tilt_deg(field):.1f}° becomes "
        gain += f"{turning.mean_tilt_deg(turned):.1f}°"
        if limit is not None:
            before, after = (turning.steeper_than(part, limit) for part in (field, turned))
            gain += f"; {before:.0%} of the fibres were steeper than {limit:g}°, now {after:.0%}"
        said.append(gain)
        said.append("the sheet is the upright box around the turned tissue, so its corners are empty")
        return turned, turn
    turn = float(layout.turn or 0.0)
    return (field.turned(turn) if turn else field), turn


def _angles(tiles: Tiles, layout: Layout, source: str) -> tuple[NDArray[np.float64], int]:
    """Tilts of the tiles that count, NaN for others, and how many those are."""
    least = layout.min_cover if layout.min_cover is not None else (0.05 if layout.outline else 0.5)
    measured = ~np.isnan(tiles.tilt_deg)
    covered = tiles.cover >= least
    sure = tiles.coherence >= layout.min_coherence
    angles = np.where(measured & covered & sure, tiles.tilt_deg, np.nan)
    if np.isnan(angles).all():
        if not measured.any():
            why = "no tile has any structure"
        elif not (measured & covered).any():
            most = tiles.cover.max()
            why = f"none was measured on {least:.0%} of its area, the best on {most:.0%} (--min-cover)"
        else:
            most = tiles.coherence[measured & covered].max()
            why = f"the most coherent one has {most:.3f}, --min-coherence is {layout.min_coherence:g}"
        raise TissueError(f"{source}: no tile has an orientation: {why}.")
    return angles, int(np.isnan(angles).sum())


def _outline(
    field: Field, tiles: Tiles, division: Division, source: str
) -> list[list[list[tuple[float, float]]]]:
    step = float(np.hypot(*field.right))
    try:
        polygons = mask.outline(field, step / 2)
    except TissueError as error:
        raise TissueError(f"{source}: {error}") from None
    low, scale = tiles.low, division.scale_mm
    return [
        [
            [(round((x - low[0]) * scale, 4), round((y - low[1]) * scale, 4)) for x, y in ring]
            for ring in rings
        ]
        for rings in polygons
    ]


def _meta(
    measured: Measurement,
    layout: Layout,
    tiles: Tiles,
    angles: NDArray[np.float64],
    turn: float,
    division: Division,
) -> dict[str, Any]:
    """What a method section needs."""
    kept = ~np.isnan(angles)

    def table(values: NDArray[np.float64], digits: int) -> list[list[float | None]]:
        return [
            [round(value, digits) if there else None for value, there in zip(row, keep, strict=True)]
            for row, keep in zip(values.tolist(), kept.tolist(), strict=True)
        ]

    made: dict[str, Any] = dict(measured.facts)
    made["convention"] = CONVENTION
    made["layout"] = {
        "scale_mm_per_unit": round(division.scale_mm, 9),
        "flip": layout.flip,
        "turned_deg": turn,
        "min_coherence": layout.min_coherence,
        "min_cover": layout.min_cover,
    }
    made["mean_deviation_deg"] = round(tiles.mean_deviation_deg(kept), 3)
    made["coherence"] = table(tiles.coherence, 3)
    made["deviation_deg"] = table(np.nan_to_num(tiles.deviation_deg), 2)
    if tiles.off_plane is not None:
        made["off_plane_deg"] = table(np.degrees(np.arcsin(np.sqrt(np.clip(tiles.off_plane, 0, 1)))), 1)
    return made
