"""Monte Carlo tree search: the tree, the rollouts, and what the method is worth."""

import numpy as np
import pytest
from calling import from_python
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.sequence import Problem, solve
from slicer.sequence.construct.initial import start_along_levels
from slicer.sequence.local_search.block_exchange import new_tour
from slicer.sequence.local_search.start import reach_local_optimum, tour_of
from slicer.sequence.problem.directions import directed
from slicer.sequence.problem.neighbour_lists import neighbours
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.random_numbers import Draws
from slicer.sequence.problem.search import Search
from slicer.sequence.problem.travel_cost import direct_sum
from slicer.sequence.tree_search import tree as kernels
from slicer.sequence.tree_search.rollouts import search_stretches
from slicer.sequence.tree_search.tree import NONE
from tests.fields import random_extension, segment_sets

add_child, add_node, is_child = map(from_python, (kernels.add_child, kernels.add_node, kernels.is_child))
backpropagate, may_widen, select = map(
    from_python, (kernels.backpropagate, kernels.may_widen, kernels.select)
)
SLOW_UPWARDS = Objective("time", 0.0, (50.0, 50.0, 1.0), (5000.0, 5000.0, 5000.0))


@pytest.fixture
def small_tree():
    """A root with the children 1 and 2, which add the oriented toolpaths 7 and 4."""
    tree, worth = np.zeros((5, 4), np.int32), np.zeros((5, 3))
    made = add_node(tree, worth, 0, 0)
    made = add_child(tree, worth, 0, made, 7)
    assert add_child(tree, worth, 0, made, 4) == 3
    return tree, worth


def test_children_are_known_by_what_they_add(small_tree):
    tree, _ = small_tree
    assert is_child(tree, 0, 7)
    assert is_child(tree, 0, 4)
    assert not is_child(tree, 0, 5)
    assert not is_child(tree, 1, 7)


def test_a_node_widens_with_the_root_of_its_visits():
    tree, worth = np.zeros((40, 4), np.int32), np.zeros((40, 3))
    made = add_node(tree, worth, 0, 0)
    for visit in range(100):
        if may_widen(tree, worth, 0):
            made = add_child(tree, worth, 0, made, visit)
        backpropagate(worth, 0, 1.0)
    assert made - 1 == 10


def test_the_cheaper_child_is_gone_to_until_the_other_is_in_doubt(small_tree):
    tree, worth = small_tree
    assert select(tree, worth, 1) == NONE
    chosen = []
    for visit in range(2000):
        child = visit % 2 + 1 if visit < 4 else select(tree, worth, 0)
        chosen.append(child)
        for node in (0, child):  # what child 2 costs is 0.05 more, and the spread is 0.5
            backpropagate(worth, node, 0.05 * child + visit // 2 % 2)
    assert chosen.count(1) > 1500
    assert chosen[4:].count(2) > 2


@given(segment_sets(max_n=60), st.integers(0, 2**32 - 1), st.sampled_from([Objective(), SLOW_UPWARDS]))
@settings(max_examples=60, deadline=None)
def test_search_keeps_the_sequence_printable_and_never_makes_it_worse(segments, seed, goal):
    problem = Problem.build(segments, first=None, first_flipped=[None, False, True][seed % 3])
    if problem.n == 0:
        return
    order = random_extension(np.random.default_rng(seed), problem.n, problem.edges)
    oriented = directed(problem, order, goal)
    work = new_tour(problem, goal, neighbours(problem, goal), oriented)
    state = np.array([seed], np.uint64)
    for low in (1, max(1, problem.n // 2)):
        before = work.total
        search_stretches(work, state, low, problem.n + 1, 3, 8)
        assert work.total <= before + 1e-9
        assert problem.refusal(work.oriented >> 1) is None
        fresh = new_tour(problem, goal, neighbours(problem, goal), work.oriented)
        assert np.array_equal(fresh.order, work.order)
        np.testing.assert_allclose(fresh.cost, work.cost, atol=1e-9)


def test_a_quick_search_is_far_below_greedy_and_plain_descent(reference):
    problem, _ = reference("10x10_s1")
    search = Search(problem)
    start_along_levels(search)
    work = tour_of(search, search.oriented)
    reach_local_optimum(search, work)
    assert work.total < 0.6 * solve(problem, method="greedy").travel_mm
    assert solve(problem, method="mcts", effort="quick").travel_mm < 0.92 * work.total


@pytest.mark.parametrize("name", ["2x2_s1", "4x4_s1"])
def test_small_sheets_are_ordered_nearly_as_well_as_can_be(name, reference):
    problem, known = reference(name)
    assert solve(problem, method="mcts").travel_mm <= 1.02 * known


def test_rollouts_are_ranked_by_the_objective(reference):
    problem, _ = reference("4x4_s1")

    def seconds(objective):
        search = Search(problem)
        start_along_levels(search)
        work = new_tour(problem, objective, neighbours(problem, objective), search.oriented)
        state = search.random_state(Draws.TREES)
        search_stretches(work, state, work.fixed, problem.n + 1, 10, 50)
        return direct_sum(problem.segments, SLOW_UPWARDS.cost_model, work.oriented)

    assert seconds(SLOW_UPWARDS) < 0.95 * seconds(Objective())
