"""Splice: printable, never worse than any parent, and the best of all crossings."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import searched

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem
from slicer.sequence.construct.hill_climbing import greedy
from slicer.sequence.layered.tour_merging import merge_tours, prefix_hashes
from slicer.sequence.portfolio.annealing_rounds import anneal_and_merge
from slicer.sequence.problem.directions import directed
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search
from slicer.sequence.problem.sequence_cost import true_cost
from tests.fields import random_extension, segment_sets

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]
seeds = st.integers(0, 2**32 - 1)


def printable(problem: Problem, seed: int, count: int) -> list[np.ndarray]:
    """Random printable sequences, which begin as the problem says; every other one has random directions."""
    random = np.random.default_rng(seed)
    out = []
    for turn in range(count):
        order = random_extension(random, problem.n, problem.edges)
        if problem.first is not None:
            order = np.concatenate([[problem.first], order[order != problem.first]])
        oriented = directed(problem, order)
        if turn % 2:
            oriented = (oriented ^ random.integers(0, 2, problem.n)).astype(np.int32)
            if problem.first_flipped is not None:
                oriented[0] = 2 * (oriented[0] >> 1) + problem.first_flipped
        out.append(oriented)
    return out


def crossings(problem: Problem, tours: list[np.ndarray], goal: Objective) -> float:
    """The least cost of all sequences that change from one to another where both have printed the same."""
    n = problem.n
    least = np.inf
    for way in itertools.product(range(len(tours)), repeat=n):
        if all(
            a == b or set(tours[a][:p] >> 1) == set(tours[b][:p] >> 1)
            for p, (a, b) in enumerate(itertools.pairwise(way), 1)
        ):
            chosen = np.array([tours[t][p] for p, t in enumerate(way)], np.int32)
            least = min(least, true_cost(problem, goal, chosen))
    return least


@given(segment_sets(max_n=60), seeds, st.integers(1, 5), st.sampled_from(GOALS), st.booleans())
@settings(max_examples=80, deadline=None)
def test_printable_and_no_worse_than_any_parent(segments, seed, count, goal, free):
    problem = Problem.build(segments, first=None)
    if problem.n and not free:
        problem = Problem.build(segments, first=int(problem.starts[0]) >> 1, first_flipped=bool(seed % 2))
    tours = printable(problem, seed, count)
    copies = [tour.copy() for tour in tours]
    child = merge_tours(problem, goal, tours)
    assert all((tour == copy).all() for tour, copy in zip(tours, copies, strict=True))
    assert np.array_equal(child, merge_tours(problem, goal, tours))
    if problem.n == 0:
        return
    assert problem.refusal(child >> 1) is None
    assert child[0] in problem.starts
    # A few units in the last place: the same travels, added up in another order.
    cost = true_cost(problem, goal, child)
    assert cost <= min(true_cost(problem, goal, tour) for tour in tours) * (1 + 1e-12) + 1e-12
    for p in range(problem.n):
        assert any(child[p] == tour[p] for tour in tours)


@given(segment_sets(max_n=6), seeds, st.sampled_from(GOALS))
@settings(max_examples=60, deadline=None)
def test_finds_the_best_of_all_crossings(segments, seed, goal):
    problem = Problem.build(segments, first=None)
    if problem.n == 0:
        return
    tours = printable(problem, seed, 3)
    found = true_cost(problem, goal, merge_tours(problem, goal, tours))
    assert found == pytest.approx(crossings(problem, tours, goal), abs=1e-9)


def test_two_towers_that_were_each_printed_well_once():
    # Two stacks of three lines. One sequence zigzags up the first and always comes back on the second, the
    # other one does it the other way round.
    segments = np.array([[[x, y], [x + 1.0, y]] for x in (0.0, 5.0) for y in (0.0, 0.1, 0.2)])
    problem = Problem.build(segments, first=None)
    good, bad = np.array([0, 1, 0]), np.array([0, 0, 0])
    low, high = 2 * np.arange(3), 6 + 2 * np.arange(3)
    a = np.concatenate([low + good, high + bad]).astype(np.int32)
    b = np.concatenate([low + bad, high + good]).astype(np.int32)
    child = merge_tours(problem, Objective(), [a, b])
    assert child.tolist() == [*(low + good), *(high + good)]
    assert true_cost(problem, Objective(), child) == pytest.approx(4 * 0.1 + np.hypot(4.0, 0.2))


@given(segment_sets(max_n=30), seeds)
@settings(max_examples=40, deadline=None)
def test_equal_hashes_mean_equal_sets(segments, seed):
    problem = Problem.build(segments, first=None)
    if problem.n == 0:
        return
    tours = printable(problem, seed, 3)
    printed = prefix_hashes(np.stack(tours))
    for (s, a), (t, b) in itertools.product(enumerate(tours), repeat=2):
        for p in range(problem.n):
            assert (printed[s, p] == printed[t, p]) == (set(a[:p] >> 1) == set(b[:p] >> 1))


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("goal", [Objective(), Objective("time", **MACHINE)])
def test_annealing_rounds_are_printable_never_worse_and_repeats_itself(apart, goal):
    problem = Problem.build(hatch(random_walk(3, 3, seed=4)).segments, first=0)
    start = searched(greedy, problem).oriented
    ends = []
    for _ in range(2):
        search = Search(problem, objective=goal, seed=7, initial=start)
        assert anneal_and_merge(search, apart=apart, windows=True)
        assert problem.refusal(search.oriented >> 1) is None
        ends.append(search.oriented)
    assert np.array_equal(*ends)
    assert true_cost(problem, goal, ends[0]) < true_cost(problem, goal, start)
