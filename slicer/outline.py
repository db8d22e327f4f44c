"""The outline of a sheet: polygons as people and programs draw them, made into an area."""

import math

import numpy as np
import shapely

from slicer.clip import BORDER_MM

Ring = list[tuple[float, float]]
"""The corners of a closed line, in mm."""


class NoAreaError(ValueError):
    """An outline that encloses nothing."""


def repair(polygons: list[list[Ring]]) -> tuple[list[list[Ring]], list[str]]:
    """Polygons that enclose an area each, and a line for each one that had to be changed.

    Outlines that were traced in pictures touch and cross themselves. Each ring becomes the area that it
    encloses (``shapely.make_valid``), and what the holes enclose is taken from the outer ring's; whichever
    way a ring turns. Polygons that are simple stay as they are.

    Args:
        polygons: each a list of rings, the outer one first and then its holes.

    Raises:
        NoAreaError: nothing is left of any of them.
    """
    repaired: list[list[Ring]] = []
    said = []
    for k, rings in enumerate(polygons):
        drawn = _drawn(rings)
        if drawn.is_valid and _solid(drawn):
            repaired.append(rings)
            continue
        parts = shapely.get_parts(_area(drawn)).tolist()
        before, after = max(0.0, drawn.area), math.fsum(part.area for part in parts)
        fault = _fault(drawn)
        if not parts:
            said.append(f"polygon {k} has no area ({fault}, {before:g} mm² as drawn) and was left out")
            continue
        said.append(
            f"polygon {k} touches or crosses itself ({fault}) and was repaired: {before:g} mm² before, "
            f"{after:g} mm² after"
        )
        repaired += [[list(ring.coords) for ring in (part.exterior, *part.interiors)] for part in parts]
    if not repaired:
        raise NoAreaError(
            "0 mm² are left of the outline, but it must enclose more: "
            + "; ".join(said[:3])
            + ". Give each polygon at least 3 corners that are not in a line, outside its holes."
        )
    return repaired, said


def area_of(polygons: list[list[Ring]]) -> shapely.Geometry:
    """The union of polygons, an area."""
    return shapely.union_all([_area(_drawn(rings)) for rings in polygons])


def _drawn(rings: list[Ring]) -> shapely.Polygon:
    outer, *holes = [np.asarray(ring, np.float64) for ring in rings]  # lists of points are slow to convert
    return shapely.Polygon(outer, holes)


def _area(drawn: shapely.Polygon) -> shapely.Geometry:
    if drawn.is_valid and _solid(drawn):
        return drawn
    outer, *holes = [_enclosed(ring) for ring in (drawn.exterior, *drawn.interiors)]
    parts = shapely.get_parts(shapely.difference(outer, shapely.union_all(holes)))
    return shapely.union_all([part for part in parts.tolist() if _solid(part)])


def _solid(part: shapely.Polygon) -> bool:
    """Whether it is an area, and no line but for rounding, with which overlays go wrong."""
    return bool(part.area > BORDER_MM * part.length / 2)


def _enclosed(ring: shapely.LinearRing) -> shapely.Geometry:
    """What a ring encloses, without the lines and points that ``make_valid`` keeps."""
    drawn = shapely.Polygon(ring)
    made = shapely.make_valid(drawn)
    if not made.is_valid:  # corners within rounding of a line: GEOS's other way takes longer and holds
        made = shapely.make_valid(drawn, method="structure", keep_collapsed=False)
    parts = shapely.get_parts(made)
    return shapely.union_all(parts[shapely.get_dimensions(parts) == 2])


def _fault(drawn: shapely.Polygon) -> str:
    """Why a polygon is no simple one, in GEOS's words and with the place."""
    if drawn.is_valid:
        return "thinner than a nanometre"
    reason, _, place = str(shapely.is_valid_reason(drawn)).partition("[")
    where = ", ".join(f"{float(number):g}" for number in place.rstrip("]").split())
    return reason.strip().lower() + (f" at ({where})" if where else "")
