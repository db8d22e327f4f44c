"""Pictures of what was measured: the tissue with its tiles and their directions, and the trade of a sweep."""

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue.libraries import library
from tissue.measurement import Measurement
from tissue.orient import Oriented

DIRECTION, TOOLPATH = "#d62728", "#ff7f0e"
LONGEST_IN = 8.0
LEAST_OPACITY = 0.15
MOST_BORDERS = 400
"""With more tiles than this in a row, their borders would cover the tissue."""


def draw(
    measured: Measurement, oriented: Oriented, toolpaths: NDArray[np.float64] | None = None, *, dpi: int = 150
) -> bytes:
    """PNG of the tissue with the tile grid and a stroke a tile, the more opaque the more coherent.

    Args:
        toolpaths: float64 (n, 2, 2) in mm, drawn as well where they are given.
    """
    figures, collections = library("matplotlib.figure"), library("matplotlib.collections")
    transforms = library("matplotlib.transforms")
    sheet = oriented.sheet
    width, height = sheet.cols * sheet.tile_mm[0], sheet.rows * sheet.tile_mm[1]
    scale = LONGEST_IN / max(width, height)
    figure = figures.Figure(
        figsize=(max(4.0, width * scale), max(3.0, height * scale) + 0.6), layout="constrained"
    )
    axes = figure.add_subplot()
    place = transforms.Affine2D(_to_mm(measured, oriented)) + axes.transData
    shown = _contrast(measured.backdrop)
    rows, cols = shown.shape
    axes.imshow(
        shown,
        cmap="gray",
        extent=(0, cols, rows, 0),
        transform=place,
        interpolation="nearest",
        vmin=0,
        vmax=1,
    )
    x = np.linspace(0, width, sheet.cols + 1, dtype=np.float64)
    y = np.linspace(0, height, sheet.rows + 1, dtype=np.float64)
    if max(sheet.cols, sheet.rows) <= MOST_BORDERS:
        borders = [[(a, 0.0), (a, height)] for a in x] + [[(0.0, b), (width, b)] for b in y]
        axes.add_collection(collections.LineCollection(borders, colors="#1f77b4", linewidths=0.4, alpha=0.7))
    for rings in sheet.outline_mm or []:
        axes.add_collection(
            collections.LineCollection([[*ring, ring[0]] for ring in rings], colors="#2ca02c", linewidths=1.2)
        )
    if toolpaths is not None:
        axes.add_collection(collections.LineCollection(list(toolpaths), colors=TOOLPATH, linewidths=0.5))
    axes.add_collection(_strokes(collections, oriented, x, y))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
    kept = int(oriented.kept.sum())
    axes.set_title(
        f"{kept} of {sheet.cols}x{sheet.rows} tiles, mean deviation {oriented.deviation_deg:.1f}°",
        fontsize=10,
    )
    return _png(figure, dpi)


def _strokes(collections: Any, oriented: Oriented, x: NDArray[np.float64], y: NDArray[np.float64]) -> Any:
    """A stroke a tile along its fibres."""
    sheet, kept = oriented.sheet, oriented.kept
    radians = np.radians(sheet.angles_deg[kept])
    half = 0.42 * min(sheet.tile_mm) * np.stack([np.cos(radians), np.sin(radians)], axis=1)
    middle = np.stack(np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2), axis=-1)[kept]
    opacity = LEAST_OPACITY + (1 - LEAST_OPACITY) * oriented.tiles.coherence[kept]
    colours = np.tile(library("matplotlib.colors").to_rgba(DIRECTION), (len(opacity), 1))
    colours[:, 3] = np.clip(opacity, 0, 1)
    wide = 2.0 if max(sheet.cols, sheet.rows) <= 32 else 1.0
    return collections.LineCollection(
        np.stack([middle - half, middle + half], axis=1), colors=colours, linewidths=wide, capstyle="round"
    )


def _to_mm(measured: Measurement, oriented: Oriented) -> NDArray[np.float64]:
    """(3, 3) from pixels of the backdrop, x right and y down from its corner, to mm on the sheet."""
    field, (across, down) = oriented.field, measured.backdrop_cells
    corner = field.origin - field.right / 2 - field.down / 2 - np.asarray(oriented.tiles.low)
    place = np.eye(3)
    place[:2] = np.stack([field.right * across, field.down * down, corner], axis=1) * oriented.scale_mm
    return place


def _contrast(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """Values from 0 to 1, the darkest and the brightest hundredth cut off; what is not finite is 0."""
    finite = values[np.isfinite(values)]
    low, high = np.percentile(finite, [1, 99]) if finite.size else (0.0, 1.0)
    scaled = (values.astype(np.float64) - low) / (high - low if high > low else 1.0)
    return np.clip(np.nan_to_num(scaled, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)


def draw_sweep(rows: Sequence[dict[str, float]], *, dpi: int = 150) -> bytes:
    """PNG of a sweep: deviation, printed length, travel and time over the side of a tile.

    Args:
        rows: with the keys tile_mm, deviation_deg, printed_mm, travel_mm and time_s.
    """
    figure = library("matplotlib.figure").Figure(figsize=(8, 5.5), layout="constrained")
    panels = {
        "deviation_deg": "mean deviation (°)",
        "printed_mm": "printed length (mm)",
        "travel_mm": "travel (mm)",
        "time_s": "estimated time (s)",
    }
    side = [row["tile_mm"] for row in rows]
    for axes, (key, name) in zip(figure.subplots(2, 2).flat, panels.items(), strict=True):
        axes.plot(side, [row[key] for row in rows], "o-", color=DIRECTION)
        axes.set(xlabel="tile (mm)", ylabel=name, xscale="log", ylim=(0, None))
        axes.set_xticks(side, [f"{value:.3g}" for value in side], minor=False)
        axes.minorticks_off()
    return _png(figure, dpi)


def _png(figure: Any, dpi: int) -> bytes:
    held = BytesIO()
    figure.savefig(held, format="png", dpi=dpi)
    return held.getvalue()
