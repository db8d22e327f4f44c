"""By which angle to turn tissue so that its fibres lie flat: flat fibres print best."""

import numpy as np
from numpy.typing import NDArray

from tissue.field import Field, anisotropy, tilt_deg

STEP_DEG = 0.5


def steepness(field: Field) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tilts at steps of ``STEP_DEG`` and how much of the fibres has each, as shares."""
    bins = round(180 / STEP_DEG)
    strength = (anisotropy(field.tensor) * field.weight).ravel()
    at = np.round((tilt_deg(field.tensor).ravel() + 90) / STEP_DEG).astype(np.intp) % bins
    share = np.bincount(at, strength, bins)
    return np.linspace(-90, 90, bins, endpoint=False, dtype=np.float64), share / max(
        float(share.sum()), 1e-300
    )


def best_turn(field: Field, max_tilt_deg: float | None = None) -> float:
    """The turn in (-90, 90] that gives the flattest fibres; of equal ones the least.

    Args:
        max_tilt_deg: first of all, as few fibres as possible shall be steeper than this.
    """
    tilts, share = steepness(field)
    best = (np.inf, np.inf, np.inf)
    found = 0.0
    for turn in np.arange(-90 + STEP_DEG, 90 + STEP_DEG / 2, STEP_DEG).tolist():
        tilted = np.abs((tilts + turn + 90) % 180 - 90)
        too_steep = 0.0 if max_tilt_deg is None else float(share[tilted > max_tilt_deg].sum())
        rank = (round(too_steep, 6), round(float((share * tilted).sum()), 6), abs(turn))
        if rank < best:
            best, found = rank, turn
    return float(found)


def mean_tilt_deg(field: Field) -> float:
    """Mean of |tilt| over the fibres, in degrees."""
    tilts, share = steepness(field)
    return float((share * np.abs(tilts)).sum())


def steeper_than(field: Field, tilt: float) -> float:
    """Share of the fibres that is steeper than this tilt, 0 to 1."""
    tilts, share = steepness(field)
    return float(share[np.abs(tilts) > tilt].sum())
