"""Random sheets for property tests, and brute-force definitions to hold the fast code against."""

import numpy as np
import shapely
from hypothesis import strategies as st

from slicer.errors import CycleError
from slicer.grid import Grid
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem

EPS = 1e-9

tilts = st.one_of(
    st.sampled_from([0.0, 90.0, 45.0, -45.0, 89.9, -89.9, 0.1, -0.1]),
    # What is next to level and upright, down to the last bit.
    st.builds(
        lambda side, deviation, sign: side - deviation if side else sign * deviation,
        st.sampled_from([0.0, 90.0, -90.0 + 1e-13]),
        st.sampled_from([1e-14, 1e-9, 1e-7, 1e-5, 1e-3, 0.01, 0.03]),
        st.sampled_from([1, -1]),
    ).map(lambda angle: angle if -90 < angle <= 90 else 180 + angle),
    st.floats(-89.99, 90, allow_nan=False).map(lambda angle: round(angle, 2)),
)


@st.composite
def grids(draw, max_tiles=3, empty=True, outline=True):
    """A sheet of up to max_tiles x max_tiles tiles with every kind of tilt, empty tiles and an outline."""
    cols, rows = draw(st.integers(1, max_tiles)), draw(st.integers(1, max_tiles))
    angle = st.one_of(st.none(), tilts, tilts, tilts) if empty else tilts
    angles = [[draw(angle) for _ in range(cols)] for _ in range(rows)]
    tile = draw(st.sampled_from([(1.0, 1.0), (2.0, 1.0), (0.7, 1.3)]))
    spacing = draw(st.sampled_from([0.2, 0.25, 0.31, 0.5]))
    rings = None
    if outline and draw(st.booleans()):
        width, height = cols * tile[0], rows * tile[1]
        middle = np.array([width, height]) / 2
        outer = [(0.05 * width, 0.0), (width, 0.1 * height), (0.9 * width, height), (0.0, 0.8 * height)]
        hole = [
            tuple((middle + 0.17 * min(width, height) * np.array([np.cos(t), np.sin(t)])).tolist())
            for t in np.linspace(0, 2 * np.pi, 7)[:-1]
        ]
        rings = [[outer, hole]]
    return Grid(
        np.array([[np.nan if a is None else a for a in row] for row in angles], float),
        np.full((rows, cols), spacing),
        tile,
        outline_mm=rings,
        min_length_mm=draw(st.sampled_from([None, 0.05])),
    )


@st.composite
def rough_outlines(draw):
    """Polygons and holes of any shape, in part across themselves, each other and the tiles' borders."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    polygons = []
    for _ in range(draw(st.integers(1, 3))):
        n = draw(st.sampled_from([3, 4, 7, 40]))
        centre = random.uniform(0, 3, 2)
        t = np.sort(random.uniform(0, 2 * np.pi, n)) if draw(st.booleans()) else random.uniform(0, 6, n)
        reach = random.uniform(0.05, draw(st.sampled_from([0.3, 2.0])), n)
        ring = centre + np.stack([reach * np.cos(t), reach * np.sin(t)], axis=1)
        if draw(st.booleans()):
            ring = np.round(ring, 1)
        hole = centre + 0.3 * (ring - centre)
        rings = [ring, hole] if draw(st.booleans()) else [ring]
        polygons.append([list(map(tuple, r.tolist())) for r in rings])
    return polygons


@st.composite
def segment_sets(draw, max_tiles=3, max_n=None):
    """The toolpaths of a random sheet, some left out, in random order and direction."""
    segments = hatch(draw(grids(max_tiles))).segments
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    keep = random.permutation(len(segments))[: max_n or len(segments)]
    keep = keep[random.random(len(keep)) < draw(st.sampled_from([1.0, 0.8, 0.4]))]
    chosen = segments[keep]
    flip = random.random(len(chosen)) < 0.5
    return np.where(flip[:, None, None], chosen[:, ::-1], chosen)


@st.composite
def loose_segments(draw, max_n=25):
    """Segments of any length and tilt that do not meet, some of them upright or level."""
    n = draw(st.integers(1, max_n))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kept = []
    for _ in range(4 * n):
        start = random.uniform(0, 3, 2)
        step = random.normal(0, draw(st.sampled_from([0.3, 1.0])), 2) * random.choice(
            [[1, 1], [1, 0], [0, 1]]
        )
        line = shapely.LineString([start, start + step])
        if np.hypot(*step) > 0.02 and all(line.distance(other) > 1e-3 for other in kept):
            kept.append(line)
        if len(kept) == n:
            break
    return np.array([line.coords for line in kept])


def height_at(segment, x):
    """y of a slanted segment at x."""
    (x0, y0), (x1, y1) = segment
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)


def lies_below(b, a):
    """The definition: b is strictly below a at some x of the open overlap of their x-ranges."""
    b, a = b[np.lexsort((b[:, 1], b[:, 0]))], a[np.lexsort((a[:, 1], a[:, 0]))]
    b_upright, a_upright = np.ptp(b[:, 0]) <= EPS, np.ptp(a[:, 0]) <= EPS
    if b_upright and a_upright:
        return abs(b[0, 0] - a[0, 0]) <= EPS and b[:, 1].max() <= a[:, 1].min() + EPS
    if b_upright or a_upright:
        upright, slanted = (b, a) if b_upright else (a, b)
        x = upright[0, 0]
        if not slanted[0, 0] + EPS < x < slanted[1, 0] - EPS:
            return False
        y = height_at(slanted, x)
        if b_upright:
            return upright[:, 1].max() <= y + EPS
        return y <= upright[:, 1].min() + EPS
    left, right = max(b[0, 0], a[0, 0]), min(b[1, 0], a[1, 0])
    if right - left <= EPS:
        return False
    middle = (left + right) / 2
    return height_at(b, middle) < height_at(a, middle) - EPS


def relation(segments):
    """Boolean (n, n): row lies below column, by the definition."""
    n = len(segments)
    below = np.zeros((n, n), bool)
    for b in range(n):
        for a in range(n):
            below[b, a] = a != b and lies_below(segments[b], segments[a])
    return below


def hard_core(body, far=1e4):
    """What of a nozzle at (0, 0) may not touch material: the body with every face moved inwards by its press.

    A little more is left out, so that what only touches it is not in it. Open upwards; None where nothing is left.
    """
    press = body.press + 1e-7
    slant = press * np.hypot(1.0, body.flank)  # a flank moved inwards, along x
    parts = []
    floor = press
    if body.flank > 0 and body.half_width < slant:
        floor = max(press, (slant - body.half_width) / body.flank)
    if body.flank > 0 or body.half_width > slant:
        low, high = (body.half_width + y * body.flank - slant for y in (floor, far))
        cone = shapely.Polygon([(-low, floor), (low, floor), (high, far), (-high, far)])
        side = max(min(body.barrel, far) - press, 0.0)
        parts.append(cone.intersection(shapely.box(-side, 0, side, far)) if side else shapely.Polygon())
    if np.isfinite(body.length) and body.shoulder > press:
        side = body.shoulder - press
        parts.append(shapely.box(-side, body.length + press, side, far))
    if np.isfinite(body.barrel_from) and body.barrel > press:
        side = body.barrel - press
        parts.append(shapely.box(-side, body.barrel_from + press, side, far))
    return shapely.union_all(parts) if parts else None


def hindered(segments, body):
    """Boolean (n, n): row must be printed before column, by the definition of a nozzle with this body.

    Everything that column's toolpath would have in the hard core while row is printed: the differences of their
    points fill a parallelogram.
    """
    before = relation(segments)
    core = hard_core(body) if body.half_width > 0 else None
    if core is None:
        return before
    for b, a in np.ndindex(before.shape):
        if a != b:
            differences = (segments[a][:, None] - segments[b][None]).reshape(-1, 2)
            before[b, a] |= shapely.MultiPoint(differences).convex_hull.intersects(core)
    return before


def allowed_by(segments, downhill_deg):
    """Boolean (n, 2): whether a toolpath, printed from that end, runs down no more steeply than this."""
    dx, dy = np.abs(segments[:, 1, 0] - segments[:, 0, 0]), segments[:, 1, 1] - segments[:, 0, 1]
    falls = np.stack([-dy, dy], axis=1)
    if downhill_deg == 90:
        return np.ones(falls.shape, bool)
    return falls <= dx[:, None] * np.tan(np.radians(downhill_deg)) + 1e-7


def random_body(random, scale):
    """A nozzle of any kind whose dimensions are about ``scale``, none of them round."""
    half, press = random.uniform(0.05, 1.2) * scale, random.choice([0.0, random.uniform(0.0, 0.5)]) * scale
    cone = random.choice([0.0, np.degrees(np.arctan(random.uniform(0.05, 1.5)))])
    barrel = random.choice([0.0, half + random.uniform(0.0, 1.0) * scale])
    length, shoulder = np.inf, 0.0
    if random.random() < 0.4:
        length = random.uniform(0.2, 2.0) * scale
        shoulder = random.choice([0.0, half + random.uniform(0.1, 4.0) * scale])
    cone_mm = random.choice([0.0, 0.0, random.uniform(0.1, 1.5) * scale])
    return NozzleBody.of(2 * half, cone, length, 2 * shoulder, press, 2 * barrel, cone_mm)


def under_some_body(random, segments):
    """Their problem under a body that often ties columns; None where it cannot be printed."""
    try:
        return Problem.build(segments, body=random_body(random, 0.2))
    except CycleError:
        return None


def closure(below):
    """Transitive closure of a boolean (n, n) relation."""
    reach = below.copy()
    for k in range(len(reach)):
        reach |= reach[:, k : k + 1] & reach[k]
    return reach


def random_extension(random, n, edges):
    """A random order that keeps the precedence ``edges`` (m, 2)."""
    missing = np.bincount(edges[:, 1], minlength=n)
    ready, order = list(np.flatnonzero(missing == 0)), []
    while ready:
        s = ready.pop(random.integers(len(ready)))
        order.append(s)
        for above in edges[edges[:, 0] == s, 1]:
            missing[above] -= 1
            if missing[above] == 0:
                ready.append(above)
    return np.array(order, int)


def blocked(printed, start, end, eps=1e-8):
    """Whether the straight line from start to end passes below something printed, strictly inside."""
    if abs(start[0] - end[0]) <= EPS:
        return False
    line = np.array(sorted([tuple(start), tuple(end)]))
    for segment in printed:
        s = segment[np.lexsort((segment[:, 1], segment[:, 0]))]
        if s[1, 0] - s[0, 0] <= EPS:
            inside = line[0, 0] + EPS < s[0, 0] < line[1, 0] - EPS
            if inside and s[:, 1].max() > height_at(line, s[0, 0]) + eps:
                return True
            continue
        left, right = max(s[0, 0], line[0, 0]), min(s[1, 0], line[1, 0])
        if right - left > EPS and any(height_at(s, x) > height_at(line, x) + eps for x in (left, right)):
            return True
    return False


def taut_length(printed, start, end):
    """Length of the shortest path from start to end above printed material, by shapely's convex hull."""
    low, high = sorted([tuple(start), tuple(end)])
    points = [low, high]
    for segment in printed:
        s = segment[np.lexsort((segment[:, 1], segment[:, 0]))]
        if s[1, 0] - s[0, 0] <= EPS:
            if low[0] + EPS < s[0, 0] < high[0] - EPS:
                points.append((s[0, 0], s[:, 1].max()))
            continue
        left, right = max(s[0, 0], low[0]), min(s[1, 0], high[0])
        if right - left > EPS:
            points += [(left, height_at(s, left)), (right, height_at(s, right))]
    # Far below, so that the hull is closed by three sides that are known.
    floor = min(y for _, y in points) - 1000.0
    hull = shapely.convex_hull(shapely.MultiPoint([*points, (low[0], floor), (high[0], floor)]))
    tops = [max(y for x, y in points if abs(x - end_x) <= EPS) for end_x in (low[0], high[0])]
    upper = hull.length - (high[0] - low[0]) - (tops[0] - floor) - (tops[1] - floor)
    return upper + (tops[0] - low[1]) + (tops[1] - high[1])
