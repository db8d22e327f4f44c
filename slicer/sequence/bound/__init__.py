"""Lower bounds, which prove: by Lagrangian decomposition into pairs of columns, held or streamed;
over relaxed states or by a spanning tree where columns have too many.

They keep to the precedence inside a block of columns, and leave out what joins columns that no block has.
"""

from slicer.sequence.bound.nearby import PACE
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.relaxed_bound import raise_relaxed_bound
from slicer.sequence.bound.streamed_ascent import (
    climb,
    is_streamable,
    open_streamed_bound,
    raise_streamed_bound,
)
from slicer.sequence.bound.streamed_bound import StreamedBound
from slicer.sequence.bound.streamed_columns import Layout
from slicer.sequence.bound.streamed_states import StateValues
from slicer.sequence.bound.subgradient_ascent import step_lengths
from slicer.sequence.bound.tree_bound import TreeBound, raise_cheap_bound

__all__ = [
    "PACE",
    "Layout",
    "PairBound",
    "StateValues",
    "StreamedBound",
    "TreeBound",
    "climb",
    "is_streamable",
    "open_streamed_bound",
    "raise_cheap_bound",
    "raise_relaxed_bound",
    "raise_streamed_bound",
    "step_lengths",
]
