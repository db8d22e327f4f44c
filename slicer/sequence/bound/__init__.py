"""Lower bounds by Lagrangian decomposition into pairs of columns: one held in memory, one streamed."""

from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.streamed_bound import raise_streamed_bound

__all__ = [
    "PairBound",
    "raise_streamed_bound",
]
