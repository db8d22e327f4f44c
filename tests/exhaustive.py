"""The optimum by brute force, and what a sequence costs, with geometry and kinematics of their own.

Nothing of the package is called here. Precedence is the definition in ``fields``, a route is found by splitting
at the point farthest above it, and an ``Objective`` is read as a record of numbers alone.
"""

from itertools import pairwise

import numpy as np
from fields import EPS, blocked, height_at, relation


def seconds(objective, dx, dy):
    """Time of one straight leg from rest to rest, under the limits of path and axes."""
    way = np.hypot(dx, dy)
    shares = [1.0, abs(dx) / way, abs(dy) / way]  # of the path's speed that path, x and y have
    speed = min(limit / share for limit, share in zip(objective.speed_mm_s, shares, strict=True) if share)
    ramp = min(
        limit / share for limit, share in zip(objective.acceleration_mm_s2, shares, strict=True) if share
    )
    reached = np.sqrt(way * ramp)  # speed in the middle, had it no limit
    if reached <= speed:
        return 2 * reached / ramp
    return 2 * speed / ramp + (way - speed**2 / ramp) / speed


def route(printed, start, end, clearance):
    """Points of a travel: two, or over what is printed, lifted by the clearance."""
    start, end = tuple(map(float, start)), tuple(map(float, end))
    if not blocked(printed, np.array(start), np.array(end)):
        return [start, end]
    low, high = sorted([start, end])
    points = [low, high]
    for segment in printed:
        s = segment[np.lexsort((segment[:, 1], segment[:, 0]))]
        if s[1, 0] - s[0, 0] <= EPS:
            if low[0] + EPS < s[0, 0] < high[0] - EPS:
                points.append((s[0, 0], s[1, 1]))
            continue
        left, right = max(s[0, 0], low[0]), min(s[1, 0], high[0])
        if right - left > EPS:
            points += [(x, height_at(s, x)) for x in (left, right)]
    ends = [(x, max(y for px, y in points if abs(px - x) <= EPS)) for x in (low[0], high[0])]
    string = [ends[0], *_farthest(points, *ends), ends[1]]
    if start > end:
        string.reverse()
    return [start, *((x, y + clearance) for x, y in string), end]


def _farthest(points, a, b):
    """The upper hull strictly between a and b: the farthest point above them, and so on either side of it."""
    above = [(height_at((a, b), x) - y, x, y) for x, y in points if a[0] + EPS < x < b[0] - EPS]
    above = [(depth, (x, y)) for depth, x, y in above if depth < -EPS]
    if not above:
        return []
    top = min(above)[1]
    return [*_farthest(points, a, top), top, *_farthest(points, top, b)]


def travel_cost(objective, printed, start, end, skyline=True):
    """Cost of one travel; straight if the objective, or ``skyline``, says so."""
    if objective.name == "straight":
        return float(np.hypot(*(np.asarray(end) - start)))
    way = route(printed, start, end, objective.clearance_mm) if skyline else [tuple(start), tuple(end)]
    legs = [(bx - ax, by - ay) for (ax, ay), (bx, by) in pairwise(way)]
    legs = [leg for leg in legs if np.hypot(*leg) > EPS]
    length = sum(np.hypot(*leg) for leg in legs)
    across, up = np.asarray(end) - start
    steep = up < 0 and np.degrees(np.arctan2(-up, abs(across))) > objective.join_downhill_deg + 1e-6
    if objective.name == "time" and len(way) == 2 and EPS < length <= objective.join_mm and not steep:
        speed = objective.speed_mm_s
        return max(length / objective.join_speed_mm_s, abs(across) / speed[1], abs(up) / speed[2])
    if objective.name == "routed":
        return length
    wait = objective.fixed_s if length > objective.fixed_from_mm else 0.0
    return wait + sum(seconds(objective, *leg) for leg in legs)


def sequence_cost(objective, segments, order, flipped):
    """Cost of a sequence, travel by travel."""
    ends = [(segments[s, int(f)], segments[s, 1 - int(f)]) for s, f in zip(order, flipped, strict=True)]
    return sum(
        travel_cost(objective, segments[list(order[:k])], ends[k - 1][1], ends[k][0])
        for k in range(1, len(order))
    )


def least_cost(
    objective,
    segments,
    first=None,
    first_flipped=None,
    last=None,
    skyline=True,
    before=None,
    allowed=None,
    travel=None,
):
    """The least cost over all linear extensions and directions; infinite where there is none.

    What a travel costs depends on its two ends and on the set that is printed, so that of all beginnings
    with one set and one last oriented toolpath only the cheapest is carried on; none else is left out.
    ``last`` is the oriented toolpath, 2 * index + flipped, to end with. ``before``, bool (n, n), is the
    precedence, of a nozzle that is a point where None is given; ``allowed``, bool (n, 2), the directions.
    ``travel`` costs a travel in place of ``travel_cost``: of the set that is printed, as bits, and both oriented
    toolpaths.
    """
    n = len(segments)
    before = relation(segments) if before is None else before
    allowed = np.ones((n, 2), bool) if allowed is None else allowed
    under = [sum(1 << int(b) for b in np.flatnonzero(column)) for column in before.T]
    directions = (0, 1) if first_flipped is None else (int(first_flipped),)
    layer = {
        (1 << s, s, f): 0.0
        for s in range(n)
        if not under[s] and first in (None, s)
        for f in directions
        if allowed[s, f]
    }
    for _ in range(n - 1):
        following = {}
        for (printed, u, f), cost in layer.items():
            lines = segments[[s for s in range(n) if printed >> s & 1]]
            for s in range(n):
                if printed >> s & 1 or under[s] & ~printed:
                    continue
                for g in np.flatnonzero(allowed[s]).tolist():
                    if travel is None:
                        ends = segments[u, 1 - f], segments[s, g]
                        total = cost + travel_cost(objective, lines, *ends, skyline=skyline)
                    else:
                        total = cost + travel(printed, 2 * u + f, 2 * s + g)
                    node = (printed | 1 << s, s, g)
                    if total < following.get(node, np.inf):
                        following[node] = total
        layer = following
    ends = {2 * s + f: cost for (_, s, f), cost in layer.items()}
    return min((cost for u, cost in ends.items() if last in (None, u)), default=np.inf if n else 0.0)
