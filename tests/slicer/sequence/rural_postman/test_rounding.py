"""Tours from solutions in parts: whole, begun where they may, and the better start for local search."""

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.problem import Search, neighbours
from slicer.sequence.rural_postman import reference, without_precedence
from slicer.sequence.rural_postman.reference import _freed, _programmed
from slicer.sequence.rural_postman.rounding import rounded

pytestmark = pytest.mark.skipif(
    reference.find_spec("highspy") is None, reason="needs highspy (pip install 'vslice[postman]')"
)


def relaxed_of(problem):
    free = _freed(problem)
    near = neighbours(free).after.reshape(free.n, 2, -1)[:, ::-1].reshape(2 * free.n, -1).copy()
    start = solve(problem, method="greedy")
    relaxed = _programmed(free, (2 * start.order + start.flipped).astype(np.int32), near)
    relaxed.raise_bound(60)
    return relaxed


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("rounds", [0, 1, 60])
def test_a_tour_has_every_toolpath_once_and_begins_where_it_may(seed, rounds, monkeypatch):
    segments = hatch(random_walk(2, 2, seed=seed)).segments
    first = None if seed % 2 else 0
    problem = Problem.build(segments, first=first, first_flipped=True if seed % 4 == 2 else None)
    free = _freed(problem)
    near = neighbours(free).after.reshape(free.n, 2, -1)[:, ::-1].reshape(2 * free.n, -1).copy()
    start = solve(problem, method="greedy")
    relaxed = _programmed(free, (2 * start.order + start.flipped).astype(np.int32), near)
    relaxed.raise_bound(rounds)
    if not len(relaxed.part):
        relaxed._solve()
    for k, noise in enumerate((0.0, 0.2, 1.0, 5.0)):
        path = rounded(relaxed, noise, np.random.default_rng(k))
        if path is None:
            continue  # a start that was used up
        assert sorted(path >> 1) == list(range(problem.n))
        assert path[0] in free.starts
        assert problem.travel_mm(path >> 1, path & 1) >= relaxed.bound - 1e-9
    assert rounded(relaxed, 0.0, np.random.default_rng(0)) is not None


def test_ends_are_near_by_reduced_cost():
    relaxed = relaxed_of(Problem.build(hatch(random_walk(2, 2, seed=3)).segments))
    near = relaxed.near(4)
    cost = {
        tuple(ends): reduced for ends, reduced in zip(relaxed.travels.tolist(), relaxed.reduced, strict=True)
    }
    for u, row in enumerate(near):
        given = [cost[tuple(sorted((u, int(v))))] for v in row if v >= 0]
        others = sorted(c for ends, c in cost.items() if u in ends and max(ends) < len(relaxed.points))
        assert given == pytest.approx(others[: len(given)], abs=1e-8)
        assert len(given) == min(4, len(others))


def test_tours_that_it_suggests_come_nearer_to_the_bound(monkeypatch):
    problem = Problem.build(hatch(random_walk(4, 4, seed=1)).segments, first=0)
    start = solve(problem, method="greedy")
    oriented = (2 * start.order + start.flipped).astype(np.int32)
    led = without_precedence(Search(problem, initial=oriented))
    monkeypatch.setitem(reference.TOURS, "default", 0)
    alone = without_precedence(Search(problem, initial=oriented))
    assert led.lower_bound_mm == alone.lower_bound_mm
    assert led.travel_mm <= 1.01 * led.lower_bound_mm < alone.travel_mm
