"""By which angle to turn tissue so that its fibres lie flat: flat fibres print best."""

import numpy as np
from numpy.typing import NDArray

from tissue.field import Field, anisotropy, tilt_deg

STEP_DEG = 0.5
WORTH_DEG, WORTH_SHARE = 1.0, 0.01
"""A turn that gains less, in mean tilt and in the share of steep fibres, is none: it only adds corners."""


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
    """The turn in (-90, 90] that gives the flattest fibres; of equal ones the least, and 0 where none pays.

    Args:
        max_tilt_deg: first of all, as few fibres as possible shall be steeper than this.
    """
    tilts, share = steepness(field)

    def rank_of(turn: float) -> tuple[float, float, float]:
        tilted = np.abs((tilts + turn + 90) % 180 - 90)
        too_steep = 0.0 if max_tilt_deg is None else float(share[tilted > max_tilt_deg].sum())
        return round(too_steep, 6), round(float((share * tilted).sum()), 6), abs(turn)

    as_it_is = best = rank_of(0.0)
    found = 0.0
    for turn in np.arange(-90 + STEP_DEG, 90 + STEP_DEG / 2, STEP_DEG).tolist():
        rank = rank_of(turn)
        if rank < best:
            best, found = rank, turn
    gains = as_it_is[0] - best[0] >= WORTH_SHARE or as_it_is[1] - best[1] >= WORTH_DEG
    return float(found) if gains else 0.0


def mean_tilt_deg(field: Field) -> float:
    """Mean of |tilt| over the fibres, in degrees."""
    tilts, share = steepness(field)
    return float((share * np.abs(tilts)).sum())


def steeper_than(field: Field, tilt: float) -> float:
    """Share of the fibres that is steeper than this tilt, 0 to 1."""
    tilts, share = steepness(field)
    return float(share[np.abs(tilts) > tilt].sum())
