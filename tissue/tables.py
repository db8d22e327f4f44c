"""Angles that were measured elsewhere: .npy and CSV, one number a tile."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slicer import grid
from slicer.grid import Grid
from tissue.errors import TissueError
from tissue.picture import checked_file, hash_of
from tissue.settings import Layout

MAX_TILES = 1_000_000
RADIANS_MOST = math.pi + 1e-6
LEAST_RADIANS = 0.75

Unit = Literal["degrees", "radians"]
EMPTY = ("", "nan", "null", "na", "none")


def read_table(path: Path, unit: Unit | None, rows_from: str) -> tuple[NDArray[np.float64], list[str]]:
    """Tilts in degrees (rows, cols), row 0 at the bottom, NaN for empty tiles, and what was assumed.

    Args:
        unit: of the numbers; None for degrees, with a word where they look like radians.
        rows_from: whether the table's first row is the sheet's "top" or "bottom" one.

    Raises:
        TissueError: it is no table of numbers, or says degrees where it should be radians.
    """
    checked_file(path)
    angles = _array(path) if path.suffix.lower() == ".npy" else _csv(path)
    if angles.size > MAX_TILES:
        raise TissueError(f"{path}: has {angles.size} angles; {MAX_TILES} is the most.")
    angles = np.where(np.isfinite(angles), angles, np.nan)
    if np.isnan(angles).all():
        raise TissueError(f"{path}: has no angle, all {angles.size} tiles are empty.")
    most, said = float(np.nanmax(np.abs(angles))), []
    broken = np.unique(angles[~np.isnan(angles) & (angles != np.round(angles))])
    if unit == "radians":
        if most > 2 * math.pi + 1e-6:
            raise TissueError(
                f"{path}: has {most:g} as an angle, more than a turn in radians, {2 * math.pi:.4f}; are "
                "they degrees? Then leave out --unit radians."
            )
        angles = np.degrees(angles)
    elif unit is None and LEAST_RADIANS <= most <= RADIANS_MOST and len(broken) > 1:
        said.append(
            f"{path}: all angles lie within ±{most:g}, as radians do (±π), and were taken as degrees; "
            "--unit radians or --unit degrees says it"
        )
    angles = (angles + 90) % 180 - 90
    angles[angles == -90] = 90.0
    return (angles[::-1] if rows_from == "top" else angles) + 0.0, said


def _array(path: Path) -> NDArray[np.float64]:
    try:
        found = np.load(path, allow_pickle=False, mmap_mode="r")
    except (OSError, ValueError, EOFError) as error:
        raise TissueError(f"{path}: is no .npy that can be read: {error}.") from None
    if not isinstance(found, np.ndarray) or found.dtype.kind not in "iuf":
        raise TissueError(f"{path}: holds {getattr(found, 'dtype', 'no array')}; numbers are needed.")
    if found.ndim != 2:
        raise TissueError(
            f"{path}: has {found.ndim} dimensions {found.shape}; a table has 2, rows and columns."
        )
    if found.size == 0 or found.size > MAX_TILES:
        raise TissueError(f"{path}: has {found.size} angles; 1 to {MAX_TILES} are needed.")
    return np.array(found, np.float64)


def _csv(path: Path) -> NDArray[np.float64]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise TissueError(f"{path}: is no text: byte at offset {error.start} is not UTF-8.") from None
    mark = next((mark for mark in (";", "\t", ",") if mark in text), ",")
    rows: list[list[float]] = []
    try:
        lines = [(n, line) for n, line in enumerate(csv.reader(text.splitlines(), delimiter=mark), 1) if line]
    except csv.Error as error:
        raise TissueError(f"{path}: is no table: {error}.") from None
    for number, line in lines:
        if line[0].lstrip().startswith("#"):
            continue
        row = []
        for column, word in enumerate(line, 1):
            word = word.strip()
            try:
                # With another mark between numbers, a comma is a decimal one.
                row.append(math.nan if word.lower() in EMPTY else float(word.replace(",", ".")))
            except ValueError:
                raise TissueError(
                    f"{path}: line {number}, column {column}: {word[:30]!r} is no number; an empty tile is "
                    "an empty cell, and a line of names begins with #."
                ) from None
        rows.append(row)
    if not rows:
        raise TissueError(f"{path}: holds no numbers.")
    for k, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise TissueError(
                f"{path}: row {k + 1} has {len(row)} numbers, but the first has {len(rows[0])}."
            )
    return np.array(rows, np.float64)


def table_grid(path: Path, layout: Layout, unit: Unit | None, rows_from: str) -> tuple[Grid, list[str]]:
    """The grid of a table, and what was assumed.

    Raises:
        TissueError: see ``read_table``, or the size of a tile is not said.
        GridError: the sheet is larger or finer than a grid may be.
    """
    angles, said = read_table(path, unit, rows_from)
    if (layout.tile_mm is None) == (layout.size_mm is None):
        raise TissueError(
            f"{path}: give the side of a tile with --tile-mm, or the width of the sheet with --size-mm."
        )
    side = layout.tile_mm if layout.tile_mm is not None else round((layout.size_mm or 0) / angles.shape[1], 6)
    meta = {
        "source": {"file": path.name, "sha256": hash_of(path)},
        "method": {"what": "a table of angles", "unit": unit or "degrees", "rows_from": rows_from},
    }
    sheet = Grid(angles, np.full(angles.shape, layout.spacing_mm), (side, side), meta=meta, source=str(path))
    return replace(grid.loads(grid.dumps(sheet), source=str(path)), warnings=()), said
