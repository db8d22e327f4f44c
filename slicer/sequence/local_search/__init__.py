"""Local search on a tour: the move (``block_exchange``); who chooses it (``descent``, ``perturbation`` and,
by the exact cost, ``refinement``); cooling (``annealing``).
"""

from slicer.sequence.local_search.annealing import (
    FIRST_TEMPERATURE,
    anneal,
    annealed,
    local,
    perturbation_budget,
)
from slicer.sequence.local_search.block_exchange import LEAST_GAIN, Tour, new_tour, refresh
from slicer.sequence.local_search.descent import descend
from slicer.sequence.local_search.perturbation import REACH
from slicer.sequence.local_search.refinement import refine
from slicer.sequence.local_search.start import reach_local_optimum, tour_of

__all__ = [
    "FIRST_TEMPERATURE",
    "LEAST_GAIN",
    "REACH",
    "Tour",
    "anneal",
    "annealed",
    "descend",
    "local",
    "new_tour",
    "perturbation_budget",
    "reach_local_optimum",
    "refine",
    "refresh",
    "tour_of",
]
