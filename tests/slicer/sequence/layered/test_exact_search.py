"""``exact`` against brute force, on degenerate sheets, and on the way to a proof."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import searched

from slicer import generate
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.bound import step_lengths
from slicer.sequence.construct import start_along_levels
from slicer.sequence.construct.hill_climbing import greedy
from slicer.sequence.layered.bounded_search import bound_around
from slicer.sequence.layered.exact_search import exact
from slicer.sequence.layered.layered_search import search_layers
from slicer.sequence.problem.search import Progress, Search


def line(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y1]]


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    free=st.booleans(),
    flipped=st.sampled_from([None, False, True]),
)
def test_equals_brute_force(sheet, optimum, seed, free, flipped):
    segments = sheet(seed, 8)
    first = None if free else int(Problem.build(segments).starts[0] >> 1)
    problem = Problem.build(segments, first=first, first_flipped=flipped)
    result = solve(problem, method="exact", seed=seed)
    assert problem.refusal(result.order) is None
    assert flipped in (None, result.flipped[0])
    assert result.travel_mm == pytest.approx(optimum(problem), abs=1e-9)
    assert result.proved


@pytest.mark.parametrize(
    ("segments", "travel"),
    [
        ([], 0.0),
        ([line(0, 0, 1, 0)], 0.0),
        ([line(0, 0, 1, 0), line(0, 1, 1, 1)], 1.0),
        ([line(0, 0, 1, 0), line(3, 0, 4, 0)], 2.0),
        ([line(0, k, 0, k + 0.5) for k in range(20)], 9.5),  # one column of uprights: a chain
        ([line(k, 0, k, 1) for k in range(20)], 19.0),  # uprights side by side: an antichain
        ([line(k, 0, k + 1, 0) for k in range(20)], 0.0),  # each ends where the next begins
        ([line(0, k, 1, k) for k in range(20)], 19.0),  # one chain
    ],
    ids=["none", "one", "two in a chain", "two apart", "uprights", "antichain", "touching", "chain"],
)
def test_degenerate_sheets_are_proved(segments, travel):
    result = solve(np.array(segments, float), method="exact", first=None)
    assert result.travel_mm == pytest.approx(travel, abs=1e-9)
    assert result.proved


def test_a_long_antichain_is_no_burden():
    segments = np.array([line(2 * k, 0, 2 * k + 1, 0) for k in range(400)], float)
    result = solve(segments, method="exact", first=0)
    assert result.travel_mm == pytest.approx(399.0)
    assert result.proved


def test_proves_a_sheet_of_the_paper_and_halves_greedy():
    segments = hatch(generate.random_walk(4, 4, seed=1)).segments
    problem = Problem.build(segments, first=0)
    result = solve(problem, method="exact")
    assert problem.refusal(result.order) is None
    assert result.proved
    assert result.travel_mm < 0.7 * solve(problem, method="greedy").travel_mm
    again = solve(problem, method="exact")
    assert (again.order == result.order).all()
    assert (again.flipped == result.flipped).all()


def test_tells_of_a_falling_travel_and_a_rising_bound():
    problem = Problem.build(hatch(generate.random_walk(3, 3, seed=2)).segments, first=0)
    told: list[Progress] = []
    found = searched(exact, problem, progress=told.append)
    travels = [p.cost for p in told]
    bounds = [p.lower_bound for p in told]
    assert travels == sorted(travels, reverse=True)
    assert bounds == sorted(bounds)
    assert bounds[-1] == found.lower_bound == travels[-1]


def test_out_of_time_it_returns_what_it_was_given_and_says_so():
    problem = Problem.build(hatch(generate.random_walk(3, 3, seed=2)).segments, first=0)
    initial = searched(greedy, problem).oriented
    found = searched(exact, problem, initial=initial, deadline=time.perf_counter() - 1.0)
    assert found.stopped
    assert problem.travel_mm(found.oriented >> 1, found.oriented & 1) <= problem.travel_mm(
        initial >> 1, initial & 1
    )


def test_interrupted_it_returns_the_best_so_far():
    problem = Problem.build(hatch(generate.random_walk(3, 3, seed=2)).segments, first=0)

    def interrupt(progress: Progress) -> None:
        if progress.stage == "search":
            raise KeyboardInterrupt

    found = searched(exact, problem, progress=interrupt)
    assert found.stopped
    assert problem.refusal(found.oriented >> 1) is None


def test_where_columns_have_too_many_down_sets_nothing_false_is_claimed(monkeypatch, sheet):
    segments = hatch(generate.random_walk(3, 3, seed=2)).segments
    problem = Problem.build(segments, first=0)
    optimum = searched(exact, problem).cost
    monkeypatch.setattr("slicer.sequence.layered.exact_search.ARCS_PER_TOOLPATH", {"default": 1})
    found = searched(exact, problem)
    assert problem.refusal(found.oriented >> 1) is None
    assert 0.0 < found.lower_bound <= optimum + 1e-9


def test_a_search_that_has_generated_enough_goes_on_narrowly():
    problem = Problem.build(hatch(generate.random_walk(4, 4, seed=1)).segments, first=0)
    search = Search(problem)
    start_along_levels(search)
    opened = bound_around(search, 40_000)
    assert opened is not None
    bound, complete = opened
    assert complete
    bound.improve(search.cost, step_lengths(5))  # far from a proof, so that nearly all states are looked at
    bound.use_best_multipliers()
    wide = search_layers(search, bound, search.cost, 5_000)
    narrow = search_layers(search, bound, search.cost, 5_000, enough=wide.generated // 10)
    assert wide.widest == 5_000
    assert wide.generated // 10 < narrow.generated < wide.generated // 2
    assert narrow.finished
    assert narrow.oriented is not None
    assert min(narrow.cost, narrow.lower_bound) <= wide.cost + 1e-9
