"""How many tiles, and how large: from the size of the tissue and what the user asked for."""

from dataclasses import dataclass

from tissue.errors import TissueError
from tissue.settings import Layout

DEFAULT_COLS = 16


@dataclass(frozen=True)
class Division:
    """Columns and rows of tiles, and what a unit of the field is on the sheet, in mm."""

    cols: int
    rows: int
    scale_mm: float


def divide(width: float, height: float, unit_mm: float | None, layout: Layout, source: str) -> Division:
    """Divide tissue into tiles.

    Args:
        width, height: of the tissue, in the field's unit.
        unit_mm: what that unit is in mm; None if nobody knows.

    Raises:
        TissueError: the size is not known, or not asked for in a way that has an answer.
    """
    if layout.size_mm is not None:
        scale = layout.size_mm / width
    elif unit_mm is not None:
        scale = unit_mm
    else:
        raise TissueError(
            f"{source}: does not say how large a pixel is; give the width of the sheet with --size-mm, or "
            "the size of a pixel with --pixel-um."
        )
    if layout.tile_mm is not None:
        cols, rows = (max(1, round(side * scale / layout.tile_mm)) for side in (width, height))
    else:
        cols, asked = layout.tiles or (DEFAULT_COLS, None)
        rows = asked or max(1, round(cols * height / width))
    return Division(cols, rows, scale)
