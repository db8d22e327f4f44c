"""The nodes that a beam over a large sheet has come to, and the way there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import Layout
from slicer.sequence.states import NONE


class Beam(NamedTuple):
    """The nodes of the layer that a beam has come to, and how it came to all before.

    Attributes:
        state: int32 (2, w, c), the down-set of each column, of this layer and room for the next.
        key: uint64 (w,), a hash of what is printed.
        cost: float64 (w,), of the travels so far, in mm.
        rest: float64 (w,), the sum of the pairs' values: about so much is to come.
        parent, last: int32 (n, w), of the nodes of every layer, the best first: the node before, and the
            oriented toolpath; ``NONE`` beyond the nodes that there are.
    """

    state: NDArray[np.int32]
    key: NDArray[np.uint64]
    cost: NDArray[np.float64]
    rest: NDArray[np.float64]
    parent: NDArray[np.int32]
    last: NDArray[np.int32]


def new_beam(layout: Layout, starts: list[tuple[int, int, int, int]], width: int) -> Beam:
    """A beam whose first layer are some starts, each (oriented toolpath, column, down-set, place)."""
    n, columns = int(layout.begin[-1]), len(layout.begin) - 1
    width = max(width, len(starts))
    beam = Beam(
        np.empty((2, width, columns), np.int32),
        np.empty(width, np.uint64),
        np.zeros(width),
        np.zeros(width),
        np.full((n, width), NONE, np.int32),
        np.full((n, width), NONE, np.int32),
    )
    for k, (u, column, to, _) in enumerate(starts):
        beam.state[0, k] = layout.set_start[:-1]
        beam.state[0, k, column] = to
        beam.last[0, k] = u
    return beam


def best_of(beam: Beam) -> NDArray[np.int32]:
    """int32 (n,), the oriented toolpaths of the cheapest node of a beam that has come to the end."""
    n = len(beam.last)
    here = beam.last[n - 1] != NONE
    at = int(np.argmin(np.where(here, beam.cost, np.inf)))
    oriented = np.empty(n, np.int32)
    for layer in range(n - 1, -1, -1):
        oriented[layer] = beam.last[layer, at]
        at = int(beam.parent[layer, at])
    return oriented
