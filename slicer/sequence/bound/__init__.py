"""Lower bounds, which prove: by Lagrangian decomposition into pairs of columns, held or streamed.

They keep to the precedence inside a block of columns, and leave out what joins columns that no block has.
"""

from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.streamed_bound import raise_streamed_bound

__all__ = [
    "PairBound",
    "raise_streamed_bound",
]
