"""Where there is tissue: a mask from an image or polygons, or found in the picture, and its outline."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.field import Field
from tissue.libraries import library

MAX_CORNERS = 100_000
LEAST_PART = 0.005
"""Pieces and holes of a found mask below this part of the picture are dust."""


def read_mask(path: Path, width: int, height: int) -> NDArray[np.bool_]:
    """bool (height, width), row 0 at the top: where a mask image is not black, or inside its polygons.

    Polygons are GeoJSON in pixels of the picture, x right and y down from its upper left corner.

    Raises:
        TissueError: it cannot be read, is of another size, or is empty.
    """
    from tissue.picture import checked_file, kind_of, read

    checked_file(path)
    if kind_of(path) is None:
        mask = _inside(_polygons(path), width, height)
    else:
        image = read(path)
        if (image.width, image.height) != (width, height):
            raise TissueError(
                f"{path}: the mask has {image.width}x{image.height} pixels, but the picture "
                f"{width}x{height}; both must agree."
            )
        values = image.pixels if image.pixels.ndim == 2 else image.pixels.max(axis=2)
        mask = np.nan_to_num(np.asarray(values)) > 0
        if image.opaque is not None:
            mask &= image.opaque
    if not mask.any():
        raise TissueError(f"{path}: the mask leaves nothing of the picture.")
    return mask


def _polygons(path: Path) -> list[list[NDArray[np.float64]]]:
    """Rings of the polygons of a GeoJSON file, the outer one first."""
    try:
        found = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError):
        raise TissueError(
            f"{path}: a mask is an image (PNG, JPEG, BMP, TIFF) or polygons in GeoJSON."
        ) from None
    polygons: list[list[NDArray[np.float64]]] = []
    waiting = [found]
    while waiting:
        part = waiting.pop()
        kind = part.get("type") if isinstance(part, dict) else None
        if kind == "FeatureCollection":
            waiting += part.get("features") or []
        elif kind == "Feature":
            waiting.append(part.get("geometry"))
        elif kind in ("Polygon", "MultiPolygon"):
            coordinates = part.get("coordinates") or []
            several = [coordinates] if kind == "Polygon" else coordinates
            polygons += [[_ring(path, ring) for ring in rings] for rings in several]
        else:
            raise TissueError(f"{path}: holds {kind or 'no GeoJSON'} where polygons are needed.")
    if not polygons:
        raise TissueError(f"{path}: holds no polygons.")
    return polygons


def _ring(path: Path, ring: Any) -> NDArray[np.float64]:
    try:
        corners = np.array([point[:2] for point in ring], np.float64).reshape(-1, 2)
    except (TypeError, ValueError, IndexError):
        corners = np.empty((0, 2))
    if len(corners) < 3 or not np.isfinite(corners).all():
        raise TissueError(f"{path}: a ring of a polygon needs at least 3 corners [x, y], all finite.")
    return corners


def _inside(polygons: list[list[NDArray[np.float64]]], width: int, height: int) -> NDArray[np.bool_]:
    """Pixels whose centres lie inside, by drawing: outer rings are filled, holes are cleared."""
    images, draw = library("PIL.Image"), library("PIL.ImageDraw")
    mask = np.zeros((height, width), np.bool_)
    for outer, *holes in polygons:
        canvas = images.new("1", (width, height))
        pen = draw.Draw(canvas)
        for ring, fill in ((outer, 1), *((hole, 0) for hole in holes)):
            pen.polygon([tuple(corner) for corner in (ring - 0.5).tolist()], fill=fill, outline=fill)
        mask |= np.asarray(canvas)
    return mask


def found_mask(field: Field) -> NDArray[np.bool_]:
    """Cells where there is structure, bool (rows, cols): its strength against that of the background.

    The logarithm of the tensor's trace is cut by the threshold that parts it best into two kinds (N. Otsu, A
    threshold selection method from gray-level histograms, IEEE Trans. SMC 9 (1979) 62-66); pieces and holes
    that are dust are dropped.

    Raises:
        TissueError: there is no structure at all.
    """
    trace = field.tensor[0] + field.tensor[1]
    there = (field.weight > 0) & (trace > 0)
    if not there.any():
        raise TissueError("--auto-mask: the picture has no structure at all.")
    least = float(trace[there].max()) * 1e-9
    strength = np.log(np.maximum(trace, least))
    mask = there & (strength > _otsu(strength[there]))
    return _without_dust(mask)


def _otsu(values: NDArray[np.float64]) -> float:
    count, edges = np.histogram(values, 256)
    middle = (edges[1:] + edges[:-1]) / 2
    below = np.cumsum(count)
    above = below[-1] - below
    low = np.cumsum(count * middle)
    with np.errstate(invalid="ignore", divide="ignore"):
        between = below * above * (low / below - (low[-1] - low) / above) ** 2
    return float(edges[1:][np.nanargmax(between)]) if np.isfinite(between).any() else float(edges[0]) - 1


def _without_dust(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    label = library("scipy.ndimage").label
    least = LEAST_PART * mask.size
    for value in (True, False):
        pieces, count = label(mask == value)
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)
        small = sizes < least
        small[0] = False
        if small[1:].all():  # nothing but dust: keep it
            continue
        mask = np.where(small[pieces], not value, mask)
    return mask


def outline(field: Field, tolerance: float) -> list[list[list[tuple[float, float]]]]:
    """Polygons around the cells that count, in the field's unit: each the outer ring, then its holes.

    Args:
        tolerance: by how much corners may be moved to leave some out.

    Raises:
        TissueError: nothing counts, or the outline has too many corners.
    """
    contour = library("contourpy").contour_generator(
        z=np.pad((field.weight >= 0.5).astype(np.float64), 1), fill_type="OuterOffset"
    )
    shapely = library("shapely")
    points, offsets = contour.filled(0.5, 2.0)
    polygons: list[list[list[tuple[float, float]]]] = []
    for corners, starts in zip(points, offsets, strict=True):
        # Columns and rows of cells, counted with the cell that was padded.
        place = field.origin + (corners[:, :1] - 1) * field.right + (corners[:, 1:] - 1) * field.down
        rings = [place[a:b] for a, b in pairwise(starts.tolist())]
        area = shapely.Polygon(rings[0], rings[1:]).buffer(0).simplify(tolerance)
        polygons += [
            [list(map(tuple, ring.coords)) for ring in (part.exterior, *part.interiors)]
            for part in shapely.get_parts(area).tolist()
            if part.geom_type == "Polygon" and part.area > 4 * tolerance**2
        ]
    count = sum(len(ring) for rings in polygons for ring in rings)
    if not polygons:
        raise TissueError("--outline: nothing is left of the mask.")
    if count > MAX_CORNERS:
        raise TissueError(f"--outline: the mask's outline has {count} corners; {MAX_CORNERS} is the most.")
    return polygons
