"""From a profile's nozzle to the one that the planner knows."""

import math

import numpy as np
from numpy.typing import NDArray

from gcode.bead import bead_height_mm, press_mm
from profiles import Profile
from slicer.nozzle import NozzleBody


def body_of(profile: Profile, spacing_mm: NDArray[np.float64]) -> NozzleBody:
    """The body of a profile's nozzle.

    Args:
        spacing_mm: float64 (n,), of each toolpath: by default beads are so high, and the lowest says how deep
            material may push into the body.
    """
    nozzle = profile.nozzle
    return NozzleBody.of(
        nozzle.tip_width_mm,
        nozzle.cone_deg,
        math.inf if nozzle.length_mm is None else nozzle.length_mm,
        nozzle.shoulder_width_mm,
        press_of(profile, spacing_mm),
        nozzle.barrel_width_mm,
        nozzle.cone_mm,
    )


def press_of(profile: Profile, spacing_mm: NDArray[np.float64]) -> float:
    """How deep material may push into a profile's nozzle, in mm; ``spacing_mm`` as for ``body_of``."""
    return press_mm(profile.nozzle, bead_height_mm(profile.material, spacing_mm))
