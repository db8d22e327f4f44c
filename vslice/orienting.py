"""Measured tissue as commands read it: which input a file is, its measurement, and what is told of it."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslice.options import no_effect
from vslice.orient_options import IMAGE, LAYOUT, TABLE, VOLUME, image_of, layout_of, measured_kind, volume_of
from vslice.terminal.session import Steps, say

if TYPE_CHECKING:
    from slicer.grid import Grid
    from tissue.measurement import Measurement
    from tissue.orient import Oriented
    from tissue.settings import Layout

DEFAULT_SPACING_MM = 0.4
TABLE_ENDINGS = (".npy", ".csv")


@dataclass(frozen=True, eq=False)
class Sheet:
    """A grid that was measured, and how; ``measured`` and ``oriented`` are None for a table."""

    grid: "Grid"
    layout: "Layout"
    measured: "Measurement | None" = None
    oriented: "Oriented | None" = None


def measure(file: Path, asked: Mapping[str, Any], *, spacing_mm: float, step: Steps) -> Sheet:
    """Measure an image, a volume or a table, and say what was assumed.

    Args:
        asked: the values of the options of ``orient_options``.
        spacing_mm: where the user gives none.

    Raises:
        TissueError, GridError: nothing can be measured in it.
        UsageError: an option has no effect on this input.
    """
    kind = measured_kind(file)
    if kind is None:
        kind = "table" if file.name.lower().endswith(TABLE_ENDINGS) else "image"
    if kind == "table":
        return _table(file, asked, spacing_mm)
    layout = layout_of(asked, spacing_mm)
    from tissue.orient import orient

    step("measuring")
    if kind == "volume":
        no_effect("a volume", *IMAGE, *TABLE, "pixel_um")
        from tissue.diffusion import measure_volume

        measured = measure_volume(file, volume_of(asked), layout)
    else:
        no_effect("an image", *VOLUME, *TABLE)
        from tissue.image import measure_image

        measured = measure_image(
            file, image_of(asked), layout, progress=lambda done: step.detail(f"{done:.0%}")
        )
    for line in measured.said:
        say(f"Note: {line}.")
    step("tiling")
    oriented = orient(measured, layout)
    for line in oriented.said:
        say(f"Note: {line}.")
    return Sheet(_hashed(oriented.sheet), layout, measured, oriented)


def _table(file: Path, asked: Mapping[str, Any], spacing_mm: float) -> Sheet:
    without = set(LAYOUT) - {"tile_mm", "size_mm", "spacing_mm"}
    no_effect("a table of angles", *IMAGE, *VOLUME, "mask", *sorted(without))
    layout = layout_of(asked, spacing_mm)
    from tissue.tables import table_grid

    sheet, said = table_grid(file, layout, asked["unit"], asked["rows_from"] or "top")
    for line in said:
        say(f"Warning: {line}.")
    return Sheet(_hashed(sheet), layout)


def _hashed(sheet: "Grid") -> "Grid":
    """A grid with the hash of the file that it would be."""
    from slicer import grid

    return replace(sheet, sha256=hashlib.sha256(grid.dumps(sheet).encode("utf-8")).hexdigest())


def rows_of(sheet: Sheet) -> dict[str, str]:
    """What a user wants to know of a measured sheet."""
    import numpy as np

    grid = sheet.grid
    kept = int((~np.isnan(grid.angles_deg)).sum())
    width, height = grid.tile_mm
    rows = {
        "tiles": f"{kept} of {grid.cols}x{grid.rows}, {width:g} x {height:g} mm each",
        "sheet": f"{grid.cols * width:.2f} x {grid.rows * height:.2f} mm",
        "mean |tilt|": f"{np.nanmean(np.abs(grid.angles_deg)):.1f}°",
    }
    if sheet.oriented is not None:
        mean = sheet.oriented.tiles.coherence[sheet.oriented.kept].mean()
        rows["coherence"] = f"{mean:.2f} on average"
        rows["mean deviation"] = (
            f"{sheet.oriented.deviation_deg:.1f}° between fibres and the angle of their tile"
        )
        if (off := sheet.oriented.off_plane_deg) is not None:
            rows["off the plane"] = f"{off:.1f}° (root mean square)"
    return rows
