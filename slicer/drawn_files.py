"""Own toolpaths from JSON and CSV, and regions from GeoJSON: what such files hold, and what is wrong."""

import csv
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slicer.drawn import (
    DEFAULT_SPACING_MM,
    DrawnSheet,
    Region,
    in_reach,
    sheet_of_regions,
    sheet_of_segments,
)
from slicer.errors import GridError
from slicer.grid_schema import LEAST_MM, MOST_MM, REACH_MM
from slicer.outline import Ring

MAX_TOOLPATHS = 5_000_000
LEAST_LENGTH_MM = 0.002
"""A toolpath of less is a point to a program, which rounds to 0.001 mm."""
GEOJSON = ("FeatureCollection", "Feature", "Polygon", "MultiPolygon")
POINT = f"two numbers of mm, within ±{REACH_MM:g}"


def is_drawn(data: object) -> bool:
    """Whether what a JSON file held is a drawn sheet rather than a grid of tiles."""
    return isinstance(data, dict) and ("segments" in data or data.get("type") in GEOJSON)


def from_json(data: dict[str, Any], source: str) -> DrawnSheet:
    """A sheet of what a JSON file held.

    Own toolpaths are {"segments": [[[x, y], [x, y]], ...], "spacing_mm": number or one each}; regions are
    GeoJSON in mm, y up, whose features have the properties angle_deg and spacing_mm.

    Raises:
        GridError: something is wrong with it; one line for each problem.
    """
    return _own(data, source) if "segments" in data else _regions(data, source)


def from_csv(text: str, source: str) -> DrawnSheet:
    """A sheet of lines x0, y0, x1, y1 and perhaps the spacing, in mm; the first line may be names.

    Raises:
        GridError: something is wrong with it.
    """
    mark = next((mark for mark in (";", "\t") if mark in text), ",")
    rows: list[list[float]] = []
    for number, words in enumerate(csv.reader(text.splitlines(), delimiter=mark), 1):
        if not any(word.strip() for word in words) or words[0].lstrip().startswith("#"):
            continue
        try:
            row = [float(word.replace(",", ".")) for word in words]
        except ValueError:
            if not rows and number == 1:
                continue
            wrong = f"line {number}: {','.join(words)[:40]!r} holds something that is no number."
            raise GridError(source, [wrong]) from None
        if len(row) not in (4, 5) or (rows and len(row) != len(rows[0])):
            wrong = f"line {number}: has {len(row)} numbers; x0, y0, x1, y1 are needed, perhaps a spacing"
            raise GridError(
                source, [f"{wrong}, in every line the same. (A table of angles wants --tile-mm.)"]
            )
        rows.append(row)
    if not rows:
        raise GridError(source, ["holds no toolpaths; a line is x0, y0, x1, y1 in mm."])
    table = np.array(rows, np.float64)
    spacing = table[:, 4] if table.shape[1] == 5 else None
    return _checked(table[:, :4].reshape(-1, 2, 2), spacing, source)


def _own(data: dict[str, Any], source: str) -> DrawnSheet:
    segments = data["segments"]
    if not isinstance(segments, list) or not segments:
        raise GridError(source, ["segments must be a list of toolpaths, [[[x, y], [x, y]], ...]."])
    problems = [
        f"segments[{k}] must be two points [x, y], each {POINT}."
        for k, segment in enumerate(segments)
        if not (isinstance(segment, list) and len(segment) == 2 and all(map(_is_point, segment)))
    ]
    if problems:
        raise GridError(source, problems)
    lines = np.array(segments, np.float64)
    spacing = data.get("spacing_mm")
    if spacing is None:
        return _checked(lines, None, source)
    several = spacing if isinstance(spacing, list) else [spacing] * len(lines)
    if len(several) != len(lines):
        wrong = f"spacing_mm has {len(several)} numbers, but there are {len(lines)} segments."
        raise GridError(source, [wrong])
    if not all(map(in_reach, several)):
        raise GridError(source, ["spacing_mm must be a number of mm, or one for each toolpath."])
    return _checked(lines, np.array(several, np.float64), source)


def _checked(lines: NDArray[np.float64], spacing: NDArray[np.float64] | None, source: str) -> DrawnSheet:
    problems = []
    if len(lines) > MAX_TOOLPATHS:
        problems.append(f"holds {len(lines)} toolpaths; {MAX_TOOLPATHS} is the most.")
    if not (np.abs(lines) <= REACH_MM).all():
        k = int(np.flatnonzero(~(np.abs(lines) <= REACH_MM).all(axis=(1, 2)))[0])
        problems.append(f"toolpath {k}: {lines[k].tolist()} must be numbers within ±{REACH_MM:g} mm.")
    else:
        length = np.hypot(*(lines[:, 1] - lines[:, 0]).T)
        problems += [
            f"toolpath {k}: is {length[k]:g} mm long; {LEAST_LENGTH_MM:g} mm is the least."
            for k in np.flatnonzero(length < LEAST_LENGTH_MM).tolist()
        ]
    if spacing is not None and not ((spacing >= LEAST_MM) & (spacing <= MOST_MM)).all():
        problems.append(f"every spacing must be from {LEAST_MM:g} to {MOST_MM:g} mm.")
    if problems:
        raise GridError(source, problems)
    warnings: tuple[str, ...] = ()
    if spacing is None:
        spacing = np.full(len(lines), DEFAULT_SPACING_MM)
        warnings = (
            f"{source}: does not say spacing_mm, how far toolpaths are apart; {DEFAULT_SPACING_MM:g} mm was "
            "taken, from which the height of a bead follows",
        )
    return sheet_of_segments(lines, spacing, source=source, warnings=warnings)


def _regions(data: dict[str, Any], source: str) -> DrawnSheet:
    features = data.get("features") if data["type"] == "FeatureCollection" else [data]
    if not isinstance(features, list) or not features:
        raise GridError(source, ["features must be a list of regions, each with a polygon and angle_deg."])
    regions, problems = [], []
    for k, feature in enumerate(features):
        found = _region(feature, data)
        if isinstance(found, Region):
            regions.append(found)
        else:
            problems.append(f"region {k}: {found}")
    least = data.get("min_length_mm")
    if least is not None and not (in_reach(least) and least >= 0):
        problems.append("min_length_mm must be a number of mm, at least 0.")
    if problems:
        raise GridError(source, problems)
    return sheet_of_regions(regions, min_length_mm=least, source=source)


def _region(feature: Any, whole: dict[str, Any]) -> "Region | str":
    """A region, or what is wrong with it."""
    if not isinstance(feature, dict):
        return "is no object."
    geometry = feature.get("geometry") if feature.get("type") == "Feature" else feature
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if not isinstance(geometry, dict) or kind not in ("Polygon", "MultiPolygon"):
        return f"has {kind or 'no geometry'} where a Polygon or a MultiPolygon is needed."
    properties = feature.get("properties")
    given = properties if isinstance(properties, dict) else {}
    angle = given.get("angle_deg")
    if not (isinstance(angle, int | float) and not isinstance(angle, bool) and abs(angle) < float("inf")):
        return "properties.angle_deg must be its tilt in degrees."
    spacing = given.get("spacing_mm", whole.get("spacing_mm", DEFAULT_SPACING_MM))
    if not (in_reach(spacing) and LEAST_MM <= spacing <= MOST_MM):
        return f"properties.spacing_mm must be from {LEAST_MM:g} to {MOST_MM:g} mm."
    coordinates = geometry.get("coordinates")
    several = [coordinates] if kind == "Polygon" else coordinates
    polygons: list[list[Ring]] = []
    for rings in several if isinstance(several, list) else [None]:
        if not isinstance(rings, list) or not rings or not all(map(_is_ring, rings)):
            return f"its rings must be lists of at least 3 corners, each {POINT}."
        polygons.append([[(float(point[0]), float(point[1])) for point in ring] for ring in rings])
    return Region(polygons, float(angle), float(spacing)) if polygons else "has no polygon."


def _is_point(point: object) -> bool:
    return isinstance(point, list) and len(point) == 2 and all(map(in_reach, point))


def _is_ring(ring: object) -> bool:
    """A list of corners; GeoJSON allows a height behind x and y."""
    return (
        isinstance(ring, list)
        and len(ring) >= 3
        and all(isinstance(point, list) and len(point) in (2, 3) and _is_point(point[:2]) for point in ring)
    )
