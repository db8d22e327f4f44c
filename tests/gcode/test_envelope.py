"""The check's replay against brute force, in orders that are right and wrong."""

import numpy as np
from fields import blocked, height_at, loose_segments, segment_sets
from hypothesis import given, settings

from gcode.envelope import replay

TOLERANCE = 1e-6


def passes_below(printed, line):
    """Whether a line lies below anything printed by clearly more than the tolerance; None if it is close."""
    clearly = any(_depth(other, line) > 1e-4 for other in printed)
    barely = any(_depth(other, line) > 1e-9 for other in printed)
    return None if clearly != barely else clearly


def _depth(other, line):
    a, b = (s[np.lexsort((s[:, 1], s[:, 0]))] for s in (other, line))
    upright = [np.ptp(s[:, 0]) <= 2 * TOLERANCE for s in (a, b)]
    if all(upright):
        return a[:, 1].max() - b[:, 1].min() if abs(a[0, 0] - b[0, 0]) <= TOLERANCE else -1
    if any(upright):
        x, slanted = (a[0, 0], b) if upright[0] else (b[0, 0], a)
        if not slanted[0, 0] + 2 * TOLERANCE < x < slanted[1, 0] - 2 * TOLERANCE:
            return -1
        y = height_at(slanted, x)
        return a[:, 1].max() - y if upright[0] else y - b[:, 1].min()
    left, right = max(a[0, 0], b[0, 0]), min(a[1, 0], b[1, 0])
    if right - left <= 4 * TOLERANCE:
        return -1
    return max(height_at(a, x) - height_at(b, x) for x in (left, right))


@settings(max_examples=150, deadline=None)
@given(segment_sets(max_n=30) | loose_segments())
def test_whatever_the_order_the_replay_finds_what_lies_below(segments):
    n = len(segments)
    order = np.random.default_rng(n).permutation(n)
    rows = np.array([[*segments[s, 0], *segments[s, 1], k] for k, s in enumerate(order)]).reshape(-1, 5)
    who, how = replay(rows, np.ones(n, bool), TOLERANCE, TOLERANCE)
    found = dict(zip(who[:, 0].tolist(), who[:, 1].tolist(), strict=True))
    for k in range(n):
        expected = passes_below(segments[order[:k]], segments[order[k]])
        if expected is not None:
            assert (k in found) == expected
        if k in found:
            assert found[k] < k
            assert _depth(segments[order[found[k]]], segments[order[k]]) > 0
    assert (how[:, 0] > 0).all()


@settings(max_examples=100, deadline=None)
@given(segment_sets(max_n=25) | loose_segments())
def test_travels_collide_exactly_when_they_are_blocked(segments):
    n = len(segments)
    random = np.random.default_rng(n)
    rows, prints, travels = [], [], []
    for k in range(n):
        start, end = random.uniform(-0.5, 3.5, (2, 2))
        rows += [[*start, *end, -1], [*segments[k, 0], *segments[k, 1], k]]
        prints += [False, True]
        travels.append((segments[:k], start, end))
    who, _ = replay(np.array(rows, float).reshape(-1, 5), np.array(prints, bool), TOLERANCE, TOLERANCE)
    hit = {k // 2 for k in who[:, 0].tolist() if k % 2 == 0}
    for k, (printed, start, end) in enumerate(travels):
        if blocked(printed, start, end, eps=1e-3):
            assert k in hit
        elif not blocked(printed, start, end, eps=1e-9):
            assert k not in hit


def test_what_rounding_explains_is_tolerated_and_no_more():
    """Two level lines, each off by at most the tolerance: the later may lie lower by twice that."""
    for below, found in ((0.0019, 0), (0.0025, 1)):
        rows = np.array([[0.0, 1.0, 1.0, 1.0, 1], [0.0, 1.0 - below, 1.0, 1.0 - below, 2]])
        who, _ = replay(rows, np.ones(2, bool), 0.001, 0.0)
        assert len(who) == found
