"""Local search and what it stands on: comparability, neighbours, directions, exchanges, levels."""

import itertools

import numpy as np
import pytest
from calling import from_python
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.sequence import Problem, solve
from slicer.sequence.construct.levels import level_start
from slicer.sequence.local_search import block_exchange, descent, perturbation
from slicer.sequence.local_search.block_exchange import new_tour
from slicer.sequence.problem.comparability import realizer
from slicer.sequence.problem.directions import directed
from slicer.sequence.problem.neighbour_lists import neighbours
from slicer.sequence.problem.objective import Objective
from tests.fields import closure, random_extension, relation, segment_sets

best_move, exchange = from_python(descent.best_move), from_python(block_exchange.exchange)
random_exchange = from_python(perturbation.random_exchange)
TIMED = Objective("time", 0.2, (30.0, 50.0, 5.0), (500.0, 500.0, 50.0), 0.1, 0.5)
seeds = st.integers(0, 2**32 - 1)


def start_of(problem, seed):
    """A random printable sequence in the best directions."""
    order = random_extension(np.random.default_rng(seed), problem.n, problem.edges)
    return directed(problem, order)


@given(segment_sets(max_n=60))
@settings(max_examples=60, deadline=None)
def test_two_ranks_tell_what_lies_below(segments):
    problem = Problem.build(segments, first=None)
    ranks = realizer(problem)
    below = (ranks[:, None] < ranks[None, :]).all(axis=2)
    assert np.array_equal(below, closure(relation(problem.segments)))


@given(segment_sets(max_n=40))
@settings(max_examples=40, deadline=None)
def test_neighbours_can_follow_directly_and_none_that_is_nearer_is_left_out(segments):
    problem = Problem.build(segments, first=None)
    near = neighbours(problem, count=6)
    below = closure(relation(problem.segments))
    direct = {tuple(edge) for edge in problem.edges.tolist()}
    points = problem.segments.reshape(-1, 2)
    for u in range(2 * problem.n):
        s = u >> 1
        can = [
            v
            for v in range(2 * problem.n)
            if v >> 1 != s and not below[v >> 1, s] and (not below[s, v >> 1] or (s, v >> 1) in direct)
        ]
        far = np.sort([np.hypot(*(points[v] - points[u ^ 1])) for v in can])[:6]
        listed = [v for v in near.after[u].tolist() if v >= 0]
        assert set(listed) <= set(can)
        got = [np.hypot(*(points[v] - points[u ^ 1])) for v in listed]
        np.testing.assert_allclose(got, far, atol=1e-12)
        for v in near.before[u].tolist():
            # What u can follow is what u can be a neighbour after.
            assert v < 0 or (v >> 1 != s and not below[s, v >> 1])


@given(segment_sets(max_n=6), seeds, st.sampled_from([None, False, True]))
@settings(max_examples=40, deadline=None)
def test_directions_are_the_best_of_all(segments, seed, first_flipped):
    problem = Problem.build(segments, first=None, first_flipped=first_flipped)
    order = random_extension(np.random.default_rng(seed), problem.n, problem.edges)
    oriented = directed(problem, order)
    assert np.array_equal(oriented >> 1, order)
    travels = [
        problem.travel_mm(order, flips)
        for flips in itertools.product([False, True], repeat=problem.n)
        if problem.n == 0 or first_flipped in (None, flips[0])
    ]
    assert problem.travel_mm(order, oriented & 1) == pytest.approx(min(travels), abs=1e-9)


@given(segment_sets(max_n=60), seeds, st.sampled_from([Objective(), TIMED]))
@settings(max_examples=60, deadline=None)
def test_moves_are_printable_and_gain_what_they_say(segments, seed, objective):
    problem = Problem.build(segments, first=None)
    if problem.n < 3:
        return
    work = new_tour(problem, objective, neighbours(problem, objective), start_of(problem, seed))
    random = np.random.default_rng(seed)
    spare = np.empty((problem.n + 30, 3))
    for _ in range(40):
        u = int(random.integers(2 * problem.n))
        v = int(work.near[u, 0, random.integers(work.near.shape[2])])
        if v < 0:
            continue
        gain, i, j, k, turn_a, turn_b = best_move(work, u, v, (-1e9, 0, 0, 0, 0, 0))
        if k == 0:
            continue
        before = work.total
        exchange(work, i, j, k, turn_a, turn_b, spare)
        after = new_tour(problem, objective, neighbours(problem, objective), work.oriented)
        assert problem.refusal(work.oriented >> 1) is None
        assert before - after.total == pytest.approx(gain, abs=1e-9)
        np.testing.assert_allclose(work.cost, after.cost, atol=1e-9)
        assert np.array_equal(work.order[1, : problem.n], after.order[1, : problem.n])
        placed = work.order[0, 1:-1].tolist()
        assert placed.index(v) == placed.index(u) + 1


@given(segment_sets(max_n=60), seeds)
@settings(max_examples=40, deadline=None)
def test_perturbations_are_printable(segments, seed):
    problem = Problem.build(segments, first=None)
    if problem.n < 2:
        return
    work = new_tour(problem, Objective(), neighbours(problem), start_of(problem, seed))
    state = np.array([seed], np.uint64)
    spare = np.empty((problem.n + 30, 3))
    for _ in range(30):
        i, j, k = random_exchange(work, state, work.fixed, problem.n + 1)
        if k:
            assert i < j < k
            exchange(work, i, j, k, 0, 0, spare)
            assert problem.refusal(work.oriented >> 1) is None


@given(segment_sets(max_n=60))
@settings(max_examples=40, deadline=None)
def test_the_start_along_levels_is_printable(segments):
    problem = Problem.build(segments, first=None)
    oriented = level_start(problem, Objective(), neighbours(problem))
    assert problem.n == 0 or problem.refusal(oriented >> 1) is None


def test_local_search_nears_the_optimum_of_a_4x4_sheet(reference):
    problem, known = reference("4x4_s1")
    travel = solve(problem, method="local").travel_mm
    assert known <= travel + 1e-6
    assert travel <= 1.07 * known
