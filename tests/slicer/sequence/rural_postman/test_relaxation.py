"""The linear program's bound: below every tour without precedence, and near the best."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from slicer.sequence import Problem, solve
from slicer.sequence.problem import Search
from slicer.sequence.rural_postman import reference, without_precedence
from slicer.sequence.rural_postman.violated_sets import components, growing_sets, least_left, odd_sets

highs = pytest.mark.skipif(
    reference.find_spec("highspy") is None, reason="needs highspy (pip install 'vslice[postman]')"
)


def unordered(segments, first=None, effort="default"):
    problem = Problem.build(segments, first=first)
    start = solve(problem, method="greedy")
    return without_precedence(
        Search(problem, effort=effort, initial=(2 * start.order + start.flipped).astype(np.int32))
    )


def least(segments, first):
    """The shortest tour, by dynamic programming over sets of toolpaths."""
    n, best = len(segments), {}
    for s, f in itertools.product(range(n), range(2)):
        if first in (None, s):
            best[1 << s, s, f] = 0.0
    for _ in range(n - 1):
        following = {}
        for (done, s, f), cost in best.items():
            for t, g in itertools.product(range(n), range(2)):
                if not done >> t & 1:
                    node = (done | 1 << t, t, g)
                    total = cost + float(np.hypot(*(segments[t, g] - segments[s, 1 - f])))
                    following[node] = min(total, following.get(node, np.inf))
        best = following
    return min(best.values())


def lines(seed, n=8):
    """Toolpaths of a small field, side by side in two tiles."""
    random = np.random.default_rng(seed)
    columns, rows = np.arange(n) % 2, np.arange(n) // 2
    start = np.stack([1.1 * columns, 0.3 * rows], axis=1) + random.uniform(0, 0.05, (n, 2))
    return np.stack([start, start + [[1.0, 0.1]] * random.uniform(0.4, 1.0, (n, 1))], axis=1)


@highs
@pytest.mark.parametrize("seed", range(12))
def test_no_tour_is_shorter_than_the_bound(seed):
    segments, first = lines(seed), [None, 0][seed % 2]
    found, best = unordered(segments, first), least(segments, first)
    assert found.lower_bound_mm <= best + 1e-9
    assert found.lower_bound_mm > 0.85 * best
    assert found.travel_mm == pytest.approx(best, abs=1e-9)


@highs
def test_it_is_far_above_a_tree(monkeypatch):
    file = Path(__file__).parents[3] / "data" / "reference" / "3x3_s1.json"
    segments = np.array(json.loads(file.read_text())["segments"], float)
    found = unordered(segments, 0)
    assert found.lower_bound_mm == pytest.approx(9.6387, abs=1e-4)  # a tour has it: the solution is whole
    assert found.travel_mm < 1.03 * found.lower_bound_mm
    monkeypatch.setattr(reference, "find_spec", lambda name: None)
    assert unordered(segments, 0, "quick").lower_bound_mm < 0.95 * found.lower_bound_mm


def triangles():
    """Two triangles of halves, joined by nothing: each is an odd set that nothing leaves."""
    edges = np.array([[0, 1], [1, 2], [0, 2], [3, 4], [4, 5], [3, 5]])
    return edges, np.full(6, 0.5)


def test_odd_sets_that_too_little_leaves_are_met():
    edges, part = triangles()
    met = {frozenset(chosen.tolist()) for chosen in growing_sets(6, edges, part, odd=True)}
    assert met == {frozenset({0, 1, 2}), frozenset({3, 4, 5})}
    bridge = np.concatenate([edges, [[2, 3]]])
    found = odd_sets(6, bridge, np.concatenate([part, [0.2]]))
    assert {frozenset(chosen.tolist()) for chosen in found} & met
    assert not odd_sets(6, np.array([[0, 1], [2, 3], [4, 5]]), np.ones(3))


def test_sets_of_toolpaths_that_too_little_leaves_are_met():
    ring = np.array([[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [2, 3], [0, 5]])
    part = np.array([1.0, 1.0, 0.5, 1.0, 1.0, 0.5, 0.5, 0.5])
    met = growing_sets(6, ring, part, odd=False)
    assert {frozenset(chosen.tolist()) for chosen in met} & {frozenset({0, 1, 2}), frozenset({3, 4, 5})}
    (least_one,) = least_left(6, ring, part)
    assert frozenset(least_one.tolist()) in (frozenset({0, 1, 2}), frozenset({3, 4, 5}))
    assert [part.tolist() for part in components(4, np.array([[0, 2]]))] in (
        [[0, 2], [1], [3]],
        [[1], [0, 2], [3]],
        [[1], [3], [0, 2]],
    )
