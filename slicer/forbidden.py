"""Where a printed toolpath lets the tip no longer be: the lines above that, part by part of the hard core."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.nozzle import EPS_MM, NozzleBody
from slicer.trapezoids import Points

X_EPS_MM = 1e-9
"""Two x that differ by no more count as the same, and so do two heights: see ``precedence.EPS_MM``."""


class Edge(NamedTuple):
    """The lower edge of a part of the hard core, mirrored: what a point forbids to the tip.

    Attributes:
        drop: how far below the point the level part lies, in mm.
        width: half width of the level part.
        steep: how fast the flanks fall beyond; infinity for none.
        reach: half width where the flanks end; infinity where they never do.
        straight: whether this is no part of the body, but the half-line below the tip.
    """

    drop: float
    width: float
    steep: float
    reach: float
    straight: bool


STRAIGHT = Edge(X_EPS_MM, 0.0, math.inf, 0.0, True)
"""What lies straight below a toolpath comes before it, whatever the nozzle."""


def edges_of(body: NozzleBody) -> list[Edge]:
    """The lower edges of the body's parts, where anything of them is left within ``press``."""
    if body.is_point:
        return []
    press = body.press + EPS_MM
    # The flanks moved inwards, and where they meet.
    at_tip = body.half_width - press * math.hypot(1.0, body.flank)
    width = at_tip + body.flank * press
    reach = body.barrel - press
    found = []
    if width > 0 and body.flank == 0:
        found.append(Edge(press, width, math.inf, width, False))
    elif body.flank > 0 and reach > 0:
        drop = press if width > 0 else -at_tip / body.flank
        found.append(Edge(drop, min(max(width, 0.0), reach), 1 / body.flank, reach, False))
    for begins, half_width in ((body.barrel_from, body.barrel), (body.length, body.shoulder)):
        wide = half_width - press
        if begins < math.inf and wide > 0:
            found.append(Edge(begins + press, wide, math.inf, wide, False))
    return found


class Starts(NamedTuple):
    """Where the lines of each query begin: at its higher end, less the drop.

    Attributes:
        point: float64 (q, e, 2), of each query and edge, in mm.
        at: int32 (q, e, 2), the trapezoid that holds it on the way to the right and to the left.
        wall: int32 (q,), the wall at which it stands, or -1.
        passing: int32 (q,), of an upright query the toolpath that passes below it, or -1.
    """

    point: NDArray[np.float64]
    at: NDArray[np.int32]
    wall: NDArray[np.int32]
    passing: NDArray[np.int32]


def is_upright(asked: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(asked[:, 1, 0] - asked[:, 0, 0] <= X_EPS_MM, np.bool_)


def starts_of(asked: NDArray[np.float64], edges: list[Edge], x: NDArray[np.float64]) -> tuple[Starts, Points]:
    """The starts, and as points: on the way to the right and to the left, and the lower ends of uprights."""
    q, e = len(asked), len(edges)
    top = np.where((asked[:, 0, 1] > asked[:, 1, 1])[:, None], asked[:, 0], asked[:, 1])
    point = np.repeat(top[:, None], e, axis=1)
    point[:, :, 1] -= [edge.drop for edge in edges]
    after = np.searchsorted(x, top[:, 0] + X_EPS_MM, side="right")
    before = np.searchsorted(x, top[:, 0] - X_EPS_MM, side="left")
    wall = np.where(before < after, before, -1).astype(np.int32)
    upright = is_upright(asked)
    moment = np.concatenate(
        [
            np.repeat(2 * np.stack([after, before], axis=1)[:, None], e, axis=1).ravel(),
            np.where(wall >= 0, 2 * before + 1, 2 * before)[upright],
        ]
    )
    feet = asked[upright, 0] + [0.0, X_EPS_MM]
    xy = np.concatenate([np.repeat(point[:, :, None], 2, axis=2).reshape(-1, 2), feet])
    starts = Starts(point, np.empty((q, e, 2), np.int32), wall, np.empty(q, np.int32))
    return starts, Points(xy, moment, np.argsort(moment, kind="stable"))
