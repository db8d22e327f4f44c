"""What a search through layers is given, what it drops, and what a layer of it holds."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem import CostModel
from slicer.sequence.states import Blocks, Needs, Skylines


class Sheet(NamedTuple):
    """What a search needs to know of its section, and does not change.

    Attributes:
        segments: float64 (n, 2, 2) in mm.
        column: int32 (n,), the column of each toolpath.
        local: int32 (n,), the number of each toolpath in its column, as in ``DownSets``.
        distant: what toolpaths need of columns that no block has together with theirs.
        cost_model: what a travel costs.
    """

    segments: NDArray[np.float64]
    column: NDArray[np.int32]
    local: NDArray[np.int32]
    distant: Needs
    cost_model: CostModel


class StateSpace(NamedTuple):
    """What a search goes through, and does not change.

    Attributes:
        blocks: the states of the blocks of columns.
        value: what each state costs at least from there on, see ``pair_dp.evaluate``.
        sheet: the toolpaths.
        sky: the skylines, where travels keep above what is printed.
        first_set, set_of: see ``sets_of_states``; of no interest where travels are straight and nothing is
            ``distant``.
    """

    blocks: Blocks
    value: NDArray[np.float64]
    sheet: Sheet
    sky: Skylines
    first_set: NDArray[np.int64]
    set_of: NDArray[np.int32]


class Limits(NamedTuple):
    """What is dropped of the layers, and when a search has had enough.

    Attributes:
        cut: nodes whose bound is above it, which do not count as dropped.
        width: of the others, all but so many.
        metric: whether the cost obeys the triangle inequality, so that a node is of no use if another one has
            the same printed and could go to this one's end for less.
        enough: once so many successors are generated,
        narrow: layers have so many nodes at most.
        most_nodes: the search gives up beyond so many nodes in all.
    """

    cut: float
    width: int
    metric: bool
    enough: int
    narrow: int
    most_nodes: int


class Layer(NamedTuple):
    """The nodes with one number of printed toolpaths.

    Attributes:
        state: int32 (m, b), the state of each block.
        last: int32 (m,), the last oriented toolpath.
        cost: float64 (m,), of the travels so far.
        estimate: float64 (m,), the sum of the blocks' values: at least this much is to come.
        key: uint64 (m,), a hash of what is printed.
    """

    state: NDArray[np.int32]
    last: NDArray[np.int32]
    cost: NDArray[np.float64]
    estimate: NDArray[np.float64]
    key: NDArray[np.uint64]


class Trail(NamedTuple):
    """How the nodes of every layer so far were come to, layer after layer, with room for more.

    Attributes:
        last: int32 (m,), the last oriented toolpath of each node.
        parent: int32 (m,), its number among those of the layer before; ``NONE`` in the first.
        begin: int64 (n + 1,), where each layer begins, and the end of the last one.
    """

    last: NDArray[np.int32]
    parent: NDArray[np.int32]
    begin: NDArray[np.int64]


class Seen(NamedTuple):
    """What a search has seen so far.

    Attributes:
        layers: that there are.
        dropped: the least bound dropped.
        nodes, generated: nodes whose successors were gathered, and these; a search that gives up has counted
            the layer that it would have gone on from.
        widest: the most nodes of a layer.
    """

    layers: int
    dropped: float
    nodes: int
    generated: int
    widest: int
