"""The same toolpaths without precedence: exhaustive search over all orders and directions is the reference."""

import time
from itertools import permutations, product

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.problem import Search
from slicer.sequence.rural_postman import without_precedence


def fields(seed, n=5):
    """The problem of a few short toolpaths that do not cross."""
    random = np.random.default_rng(seed)
    middle = np.stack([np.arange(n) % 3, np.arange(n) // 3], axis=1) + random.uniform(-0.2, 0.2, (n, 2))
    along = random.uniform(-1, 1, (n, 2))
    along *= 0.25 / np.hypot(*along.T)[:, None]
    return Problem.build(np.stack([middle - along, middle + along], axis=1), first=0, first_flipped=False)


def least_of_all(problem):
    """The least straight travel of any order and directions that begin as the problem says."""
    n = problem.n
    return min(
        problem.travel_mm((0, *order), (False, *flips))
        for order in permutations(range(1, n))
        for flips in product((False, True), repeat=n - 1)
    )


def start_of(problem):
    found = solve(problem, method="greedy")
    return (2 * found.order + found.flipped).astype(np.int32)


@pytest.mark.parametrize("seed", range(20))
def test_few_toolpaths_end_at_the_least_of_all(seed):
    problem = fields(seed)
    free = without_precedence(Search(problem, initial=start_of(problem)))
    least = least_of_all(problem)
    assert free.travel_mm == pytest.approx(least, abs=1e-9)
    assert free.lower_bound_mm <= least + 1e-9
    assert free.travel_mm == pytest.approx(problem.travel_mm(free.order, free.flipped), abs=1e-9)
    assert sorted(free.order) == list(range(problem.n))
    assert (free.order[0], free.flipped[0]) == (0, False)


@pytest.mark.parametrize("seed", range(6))
def test_it_is_never_longer_than_what_it_began_with(seed):
    problem = Problem.build(hatch(random_walk(3, 3, seed=seed)).segments, first=None if seed % 2 else 0)
    best = solve(problem, effort="quick")
    start = (2 * best.order + best.flipped).astype(np.int32)
    free = without_precedence(Search(problem, initial=start, effort="quick", seed=seed))
    assert free.lower_bound_mm <= free.travel_mm <= best.travel_mm
    assert sorted(free.order) == list(range(problem.n))
    assert free.travel_mm < 0.95 * best.travel_mm  # measured: precedence costs about a fifth there


def test_the_same_seed_gives_the_same():
    problem = Problem.build(hatch(random_walk(3, 2, seed=5)).segments)
    one, two = (without_precedence(Search(problem, initial=start_of(problem), seed=3)) for _ in range(2))
    assert np.array_equal(one.order, two.order)
    assert np.array_equal(one.flipped, two.flipped)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_hardly_any_toolpaths(n):
    problem = fields(0, n)
    free = without_precedence(Search(problem, initial=start_of(problem)))
    assert free.travel_mm == pytest.approx(least_of_all(problem), abs=1e-9)


def test_late_it_gives_what_it_has():
    problem = fields(1)
    late = Search(problem, initial=start_of(problem), deadline=time.perf_counter() - 1.0)
    free = without_precedence(late)
    assert late.stopped
    assert free.travel_mm == pytest.approx(late.cost)
    assert 0.0 <= free.lower_bound_mm <= least_of_all(problem) + 1e-9
