"""Which part of a toolpath would stand in the way of another one, were it printed first."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import (
    EPS_MM,
    Faces,
    NozzleBody,
    barrel_of,
    face,
    face_count,
    needle_of,
    shoulder_of,
    stands_in_the_way,
)

SAME_X_MM = 1e-9
"""As ``precedence.EPS_MM``: two x that differ by no more count as the same."""
NEEDLE, BARREL, SHOULDER, ABOVE = range(4)
"""What of a printed toolpath is in the way: see ``hindering_part``."""


@inner_kernel
def lies_above(b: NDArray[np.float64], c: NDArray[np.float64]) -> bool:
    """Whether b is higher than c at an x that both pass; neither crosses the other."""
    left = max(min(b[0, 0], b[1, 0]), min(c[0, 0], c[1, 0]))
    right = min(max(b[0, 0], b[1, 0]), max(c[0, 0], c[1, 0]))
    upright = abs(b[1, 0] - b[0, 0]) <= SAME_X_MM or abs(c[1, 0] - c[0, 0]) <= SAME_X_MM
    if upright:
        if abs(b[1, 0] - b[0, 0]) <= SAME_X_MM and abs(c[1, 0] - c[0, 0]) <= SAME_X_MM:
            return bool(abs(b[0, 0] - c[0, 0]) <= SAME_X_MM and b[0, 1] + b[1, 1] > c[0, 1] + c[1, 1])
        s, other = (b, c) if abs(b[1, 0] - b[0, 0]) <= SAME_X_MM else (c, b)
        x = (s[0, 0] + s[1, 0]) / 2
        if x <= min(other[0, 0], other[1, 0]) + SAME_X_MM or x >= max(other[0, 0], other[1, 0]) - SAME_X_MM:
            return False
    elif right - left <= SAME_X_MM:
        return False
    else:
        x = (left + right) / 2
    return bool(_height(b, x) > _height(c, x))


@inner_kernel
def _height(s: NDArray[np.float64], x: float) -> float:
    if abs(s[1, 0] - s[0, 0]) <= SAME_X_MM:
        return float((s[0, 1] + s[1, 1]) / 2)
    return float(s[0, 1] + (s[1, 1] - s[0, 1]) * (x - s[0, 0]) / (s[1, 0] - s[0, 0]))


@inner_kernel
def hinders(body: NozzleBody, b: NDArray[np.float64], c: NDArray[np.float64]) -> bool:
    """Whether b, printed, makes c unprintable: it lies above, or stands in the way of the body."""
    if max(b[0, 1], b[1, 1]) < min(c[0, 1], c[1, 1]):
        return False
    return lies_above(b, c) or stands_in_the_way(body, b, c)


@inner_kernel
def hindering_part(
    body: NozzleBody,
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    part: int,
    room: NDArray[np.float64],
) -> tuple[float, float, float, float]:
    """The points of b that hinder a point of c, and the points of c that they hinder, in parts of the length.

    A point b(t) hinders the point c(s) where some linear functions of (t, s), the distances to the faces of a
    part of the body, are all above ``press``: the unit square of (t, s) is clipped by their half
    planes. What lies straight above c hinders it too. The planes stand half of what ``hinders`` forgives
    farther in, so that rounding neither finds a part where nothing hinders, nor lets a part hinder that was
    cut off by them.

    Args:
        part: ``NEEDLE``, ``BARREL``, ``SHOULDER``, or ``ABOVE`` for what lies straight above.
        room: float64 (2, 12, 2), to clip in.

    Returns:
        (from, to, from, to) along b and along c; from > to where there are none.
    """
    low, high, first, last = np.inf, -np.inf, np.inf, -np.inf
    if part == ABOVE:
        if not lies_above(b, c):
            return low, high, first, last
        return _shared(b, c, 0), _shared(b, c, 1), _shared(c, b, 0), _shared(c, b, 1)
    if (part == BARREL and body.barrel_from == np.inf) or (part == SHOULDER and body.length == np.inf):
        return low, high, first, last
    faces = needle_of(body)
    if part == BARREL:
        faces = barrel_of(body)
    elif part == SHOULDER:
        faces = shoulder_of(body)
    for k in range(4):
        room[0, k, 0], room[0, k, 1] = 1.0 if 0 < k < 3 else 0.0, 1.0 if k > 1 else 0.0
    size = 4
    depth = body.press + EPS_MM / 2
    for number in range(face_count(faces)):
        size = _clip(depth, b, c, faces, number, size, room)
    for k in range(size):
        low, high = min(low, room[0, k, 0]), max(high, room[0, k, 0])
        first, last = min(first, room[0, k, 1]), max(last, room[0, k, 1])
    return low, high, first, last


@inner_kernel
def _shared(b: NDArray[np.float64], c: NDArray[np.float64], end: int) -> float:
    """Where along b the x-range begins (end 0) or ends that it shares with c."""
    run = b[1, 0] - b[0, 0]
    if abs(run) <= SAME_X_MM or abs(c[1, 0] - c[0, 0]) <= SAME_X_MM:
        if abs(run) <= SAME_X_MM:
            return float(end)
        return float((c[0, 0] - b[0, 0]) / run)
    one, other = (c[0, 0] - b[0, 0]) / run, (c[1, 0] - b[0, 0]) / run
    if end == 0:
        return float(max(0.0, min(one, other)))
    return float(min(1.0, max(one, other)))


@inner_kernel
def _clip(
    depth: float,
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    faces: Faces,
    number: int,
    size: int,
    room: NDArray[np.float64],
) -> int:
    """Clip the polygon of (t, s) in room[0] by the half plane of one face; the number of corners left."""
    kept = 0
    for k in range(size):
        room[1, k, 0], room[1, k, 1] = room[0, k, 0], room[0, k, 1]
    for k in range(size):
        q = k + 1 if k + 1 < size else 0
        here = _distance(b, c, faces, number, room[1, k, 0], room[1, k, 1]) - depth
        there = _distance(b, c, faces, number, room[1, q, 0], room[1, q, 1]) - depth
        if here >= 0.0:
            room[0, kept, 0], room[0, kept, 1] = room[1, k, 0], room[1, k, 1]
            kept += 1
        if here * there < 0.0:
            t = here / (here - there)
            for axis in range(2):
                room[0, kept, axis] = room[1, k, axis] + t * (room[1, q, axis] - room[1, k, axis])
            kept += 1
    return kept


@inner_kernel
def _distance(
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    faces: Faces,
    number: int,
    t: float,
    s: float,
) -> float:
    x = b[0, 0] + t * (b[1, 0] - b[0, 0]) - c[0, 0] - s * (c[1, 0] - c[0, 0])
    y = b[0, 1] + t * (b[1, 1] - b[0, 1]) - c[0, 1] - s * (c[1, 1] - c[0, 1])
    return face(faces, number, x, y)


@kernel
def hindering(body: NozzleBody, segments: NDArray[np.float64]) -> NDArray[np.bool_]:
    """bool (n, n): whether [b], printed, makes [c] unprintable. For few toolpaths: it looks at all pairs."""
    n = len(segments)
    out = np.zeros((n, n), np.bool_)
    for b in range(n):
        for c in range(n):
            if b != c:
                out[b, c] = hinders(body, segments[b], segments[c])
    return out


@kernel
def hindering_parts(body: NozzleBody, b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64 (4, 4): for each part of the body and what lies straight above, see ``hindering_part``."""
    out = np.empty((ABOVE + 1, 4))
    room = np.empty((2, 12, 2))
    for part in range(ABOVE + 1):
        low, high, first, last = hindering_part(body, b, c, part, room)
        out[part, 0], out[part, 1], out[part, 2], out[part, 3] = low, high, first, last
    return out
