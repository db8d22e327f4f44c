"""What of a program hangs: of each extrusion the parts with nothing under or beside them."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gcode.bead import bead_height_mm, said_height_mm
from gcode.errors import GcodeError
from gcode.moves import Kind, Move
from profiles.sections import Material

if TYPE_CHECKING:  # matplotlib
    from gcode.preview import Drawing


def heights_mm(moves: list[Move], lines: list[int], material: Material) -> NDArray[np.float64]:
    """float64 (n,), the height of what is laid in each of these lines, by profile or program.

    Raises:
        GcodeError: neither of them tells.
    """
    said = [(m.line, said_height_mm(m.text)) for m in moves if m.kind == Kind.COMMENT]
    said = [(line, height) for line, height in said if height > 0]
    if not said and material.height_mm is None and material.bead_shape != "circle":
        raise GcodeError(
            "how high the beads are is said neither in the program (;HEIGHT:) nor in the profile, and so not "
            "what hangs. Give it with --set material.height_mm="
        )
    if not said:
        return bead_height_mm(material, np.zeros(len(lines)))
    at = np.searchsorted([line for line, _ in said], lines) - 1
    # What comes before the first is taken to be as high.
    return bead_height_mm(material, np.array([height for _, height in said])[np.maximum(at, 0)])


def with_hanging(drawing: "Drawing", moves: list[Move], material: Material) -> "Drawing":
    """A drawing of a program with what hangs of it.

    Raises:
        GcodeError: see ``heights_mm``.
    """
    from slicer.support import hanging  # shapely

    found = hanging(drawing.toolpaths, heights_mm(moves, drawing.line, material))
    return replace(drawing, hanging=found.pieces)
