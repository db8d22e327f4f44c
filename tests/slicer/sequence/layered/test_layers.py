"""A layered search comes to the same wherever the pool had to grow and the clock was looked at."""

import dataclasses

import numpy as np
import pytest
from calling import from_python
from hypothesis import given
from hypothesis import strategies as st

from slicer import generate
from slicer.hatch import hatch
from slicer.kernels import kernel
from slicer.sequence import Problem
from slicer.sequence.bound import step_lengths
from slicer.sequence.construct import start_along_levels
from slicer.sequence.layered import (
    layered_search,
    layers,
    node_pool,
    streamed_beam,
    streamed_layers,
    successors,
)
from slicer.sequence.layered.bounded_search import bound_around
from slicer.sequence.layered.layered_search import search_layers
from slicer.sequence.layered.node_pool import BOUND, new_pool, sort_by_bound
from slicer.sequence.problem import Objective
from slicer.sequence.problem.search import Search

TIMED = Objective("time", speed_mm_s=(20.0, 5.0, 20.0), acceleration_mm_s2=(200.0, 50.0, 200.0))


def bounded(objective):
    """A search of 4x4 tiles and its bound, far from a proof."""
    problem = Problem.build(hatch(generate.random_walk(4, 4, seed=1)).segments, first=0)
    search = Search(problem, objective=objective)
    start_along_levels(search)
    opened = bound_around(search, 40_000)
    assert opened is not None
    bound, _ = opened
    bound.improve(search.cost, step_lengths(8))
    bound.use_best_multipliers()
    return search, bound


def told(found):
    """What a search has found, to be compared."""
    values = dataclasses.asdict(found)
    return values.pop("oriented").tolist(), values


@pytest.mark.parametrize("objective", [Objective(), TIMED], ids=["straight", "time"])
def test_a_pool_that_grows_in_the_midst_of_a_node_loses_nothing(monkeypatch, objective):
    search, bound = bounded(objective)
    roomy = search_layers(search, bound, search.cost, 300)
    assert roomy.widest == 300
    monkeypatch.setattr(node_pool, "FIRST_CAPACITY", 2)
    assert told(search_layers(search, bound, search.cost, 300)) == told(roomy)


@pytest.mark.parametrize("between", [1, 10_000])
def test_looks_at_the_clock_change_nothing(monkeypatch, between):
    search, bound = bounded(Objective())
    at_once = search_layers(search, bound, search.cost, 100)
    asked = []
    monkeypatch.setattr(search, "should_stop", lambda: asked.append(1) and False)
    monkeypatch.setattr(layered_search, "BETWEEN", between)
    assert told(search_layers(search, bound, search.cost, 100)) == told(at_once)
    steps = search.problem.n - 1 if between == 1 else at_once.generated // between
    assert 0.5 * steps <= len(asked) <= steps + 1


def test_a_search_gives_up_beyond_its_nodes():
    search, bound = bounded(Objective())
    whole = search_layers(search, bound, search.cost, 100)
    assert whole.finished
    given_up = search_layers(search, bound, search.cost, 100, most_nodes=whole.nodes // 2)
    assert not given_up.finished
    assert given_up.oriented is None
    assert whole.nodes // 2 < given_up.nodes <= whole.nodes // 2 + 100
    assert given_up.lower_bound == bound.bound
    assert search_layers(search, bound, search.cost, 100, most_nodes=whole.nodes).finished


def test_what_was_dropped_stays_known_where_the_pool_is_full(monkeypatch):
    """Else the search would claim that nothing was missed, and prove what is not."""
    search, bound = bounded(Objective())
    arguments = []

    def first(*args):
        arguments.extend(args)
        return layers.expand_layers(*args)

    monkeypatch.setattr(layered_search, "expand_layers", first)
    search_layers(search, bound, search.cost, 300)
    space, layer, _, _, limits = arguments[:5]
    monkeypatch.setattr(node_pool, "FIRST_CAPACITY", 2)
    pool, columns = new_pool(), int(space.sheet.column.max()) + 1
    blocks = layer.state.shape[1]
    scratch = successors.Scratch(
        np.empty(blocks), np.empty(blocks + 1), np.empty(blocks + 1), np.empty(columns, np.int32)
    )
    before = successors.Gathered(0, 0, limits.cut, 5.0, 7, 1200)
    after = from_python(successors.gather)(space, layer, pool, limits, 300, scratch, before)
    assert after == before._replace(at=after.at, size=2, generated=after.generated)
    assert after.at < len(layer.last)


def test_a_beam_does_not_depend_on_the_room_of_its_pool(monkeypatch):
    problem = Problem.build(hatch(generate.random_walk(5, 5, seed=3)).segments)

    def ends():
        search = Search(problem)
        start_along_levels(search)
        assert streamed_beam(search) is not None
        return search.cost, search.nodes_visited, search.states_created, search.oriented.tolist()

    roomy = ends()
    monkeypatch.setattr(node_pool, "FIRST_CAPACITY", 2)
    assert ends() == roomy


@kernel
def sorted_places(pool, size):
    """The chain of a pool after sorting."""
    sort_by_bound(pool, size, np.empty(size, np.int32))
    return pool.chain[:size].copy()


@given(st.lists(st.integers(0, 30) | st.floats(0, 1), max_size=200))
def test_nodes_are_sorted_by_bound_and_equal_ones_stay(bounds):
    pool = new_pool()
    pool.number[: len(bounds), BOUND] = bounds
    assert sorted_places(pool, len(bounds)).tolist() == np.argsort(bounds, kind="stable").tolist()


@pytest.mark.parametrize("gathering", [successors.gather, streamed_layers._advance])
def test_loops_over_successors_count_no_references(gathering):
    """In a kernel that may create arrays they took most of the time."""
    assert gathering.targetoptions["_nrt"] is False
