"""What can be printed at a moment: down-sets, which of them go together, blocks of columns, corridors, and
the skylines over them.
"""

from slicer.sequence.states.block_states import OUTSIDE
from slicer.sequence.states.blocks import Blocks, Follows, connect, cover
from slicer.sequence.states.certain_walls import least_over_certain
from slicer.sequence.states.closure import comes_before, never_follows
from slicer.sequence.states.column_skylines import Skylines, sets_of_states, skylines
from slicer.sequence.states.corridor import Corridor, extent, set_sizes
from slicer.sequence.states.downsets import DownSets, all_down_sets, down_sets
from slicer.sequence.states.ground import Ground
from slicer.sequence.states.group_counts import COUNTED
from slicer.sequence.states.joint_states import (
    Needs,
    holds,
    joint_states,
    needed,
    needs,
    needs_printed,
    out_of_reach,
)
from slicer.sequence.states.relaxed_columns import RelaxedColumns, few_down_sets
from slicer.sequence.states.routed_travel import FREE, cost_over, section_cost
from slicer.sequence.states.section import NONE, Section, extents
from slicer.sequence.states.tied_columns import join_tied_columns, states_of_all

__all__ = [
    "COUNTED",
    "FREE",
    "NONE",
    "OUTSIDE",
    "Blocks",
    "Corridor",
    "DownSets",
    "Follows",
    "Ground",
    "Needs",
    "RelaxedColumns",
    "Section",
    "Skylines",
    "all_down_sets",
    "comes_before",
    "connect",
    "cost_over",
    "cover",
    "down_sets",
    "extent",
    "extents",
    "few_down_sets",
    "holds",
    "join_tied_columns",
    "joint_states",
    "least_over_certain",
    "needed",
    "needs",
    "needs_printed",
    "never_follows",
    "out_of_reach",
    "section_cost",
    "set_sizes",
    "sets_of_states",
    "skylines",
    "states_of_all",
]
