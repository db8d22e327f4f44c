"""How much material a millimetre of toolpath takes."""

import math

import numpy as np
from numpy.typing import NDArray

from profiles.sections import Material, Nozzle

HEIGHT = "HEIGHT:"


def said_height_mm(comment: str) -> float:
    """The height of the beads that follow, from a comment as vslice and PrusaSlicer write it; 0 for none."""
    if not comment.startswith(HEIGHT):
        return 0.0
    try:
        value = float(comment.removeprefix(HEIGHT))
    except ValueError:
        return 0.0
    return value if math.isfinite(value) and value > 0 else 0.0


def bead_height_mm(material: Material, spacing_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Height of the beads of toolpaths with these spacings; a circle is as high as it is wide."""
    if material.bead_shape == "circle":
        return np.full(np.shape(spacing_mm), material.width_mm)
    return spacing_mm if material.height_mm is None else np.full(np.shape(spacing_mm), material.height_mm)


def press_mm(nozzle: Nozzle, height_mm: NDArray[np.float64]) -> float:
    """How deep beads of these heights may push into the nozzle: half the lowest, unless the profile says."""
    if nozzle.press_mm is not None:
        return nozzle.press_mm
    return float(np.min(height_mm, initial=np.inf)) / 2 if np.size(height_mm) else 0.0


def bead_area_mm2(material: Material, height_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross-section of beads of the profile's shape and width, one for each height.

    A stadium is a rectangle with half circles at its short ends: its area is that of the rectangle less
    (1 - pi / 4) times the square of the shorter side.
    """
    width = material.width_mm
    if material.bead_shape == "circle":
        return np.full(np.shape(height_mm), math.pi / 4 * width**2)
    area = width * np.asarray(height_mm, np.float64)
    if material.bead_shape == "stadium":
        area = area - (1 - math.pi / 4) * np.minimum(width, height_mm) ** 2
    return area


def feed_area_mm2(material: Material) -> float | None:
    """Cross-section of what the feed pushes; None where a valve meters instead."""
    if material.feed == "filament":
        return math.pi / 4 * material.filament_diameter_mm**2
    if material.feed == "syringe":
        return math.pi / 4 * material.syringe_bore_mm**2
    return None


def feed_per_mm(material: Material, height_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """E per mm of toolpath: bead area over feed area, times the flow; 0 where a valve meters."""
    feed = feed_area_mm2(material)
    if feed is None:
        return np.zeros(np.shape(height_mm))
    return bead_area_mm2(material, height_mm) / feed * material.flow
