"""Every method and every bound against the optimum by brute force, with geometry that is not the package's."""

import itertools
from contextlib import contextmanager

import numpy as np
import pytest
from exhaustive import least_cost, sequence_cost
from fields import random_extension, relation, segment_sets
from hypothesis import example, given, settings
from hypothesis import strategies as st
from searching import searched

from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.layered.layered_search import search_layers
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search
from slicer.sequence.states.corridor import widest_corridor
from slicer.sequence.states.section import Section

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
STRAIGHT, ROUTED = Objective(), Objective("routed", **MACHINE)
TIME = Objective("time", **MACHINE, fixed_s=0.05, fixed_from_mm=0.3)
GOALS = {goal.name: goal for goal in (STRAIGHT, ROUTED, TIME)}
PROVING = ("exact", "beam", "auto")
seeds = st.integers(0, 10**6)
starts = st.tuples(st.booleans(), st.sampled_from([None, False, True]))
"""Whether the first toolpath is free, and its direction."""


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


def begin(segments, start, seed=0):
    """A problem with its start fixed or not: the precedence for it is brute force."""
    free, flipped = start
    lowest = np.flatnonzero(~relation(segments).any(axis=0))
    first = None if free or not len(segments) else int(np.random.default_rng(seed).choice(lowest))
    return Problem.build(segments, first=first, first_flipped=flipped)


def least(problem, goal=STRAIGHT):
    return least_cost(goal, problem.segments, first=problem.first, first_flipped=problem.first_flipped)


def dear_start(problem, goal, seed):
    """The dearest of some random sequences, so that a bound which is too high is not hidden by its start."""
    random = np.random.default_rng(seed)
    below = np.argwhere(relation(problem.segments))
    dearest = (-1.0, None)
    for _ in range(10):
        order = random_extension(random, problem.n, below)
        if problem.first is not None:
            order = np.concatenate([[problem.first], order[order != problem.first]])
        flipped = random.random(problem.n) < 0.5
        if problem.first_flipped is not None:
            flipped[0] = problem.first_flipped
        cost = sequence_cost(goal, problem.segments, order, flipped)
        dearest = max(dearest, (cost, (2 * order + flipped).astype(np.int32).tolist()))
    return np.array(dearest[1], np.int32)


@settings(max_examples=25, deadline=None)
@given(segment_sets(max_n=4), starts, st.sampled_from(sorted(GOALS)))
def test_the_brute_force_misses_nothing(segments, start, name):
    problem, goal = begin(segments, start), GOALS[name]
    below, best = relation(segments), np.inf
    for order in itertools.permutations(range(problem.n)):
        if any(below[b, a] for a, b in itertools.combinations(order, 2)):
            continue
        if problem.first is not None and order[:1] != (problem.first,):
            continue
        for flips in itertools.product([False, True], repeat=problem.n):
            if not flips or problem.first_flipped in (None, flips[0]):
                best = min(best, sequence_cost(goal, segments, order, flips))
    assert least(problem, goal) == pytest.approx(best, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(segment_sets(max_n=8), starts, seeds)
def test_no_method_beats_all_linear_extensions(segments, start, seed):
    problem = begin(segments, start, seed)
    best = least(problem)
    for method in METHODS:
        result = solve(problem, method=method, effort="quick")
        flips = result.flipped
        assert sequence_cost(STRAIGHT, segments, result.order, flips) == pytest.approx(result.travel_mm)
        assert result.travel_mm >= best - 1e-9
        assert result.lower_bound_mm is None or result.lower_bound_mm <= best + 1e-9
        if result.proved or method in ("exact", "auto"):
            assert result.travel_mm == pytest.approx(best, abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(segment_sets(max_n=7), starts, seeds, st.sampled_from(["routed", "time"]))
def test_no_method_beats_them_over_the_skyline(segments, start, seed, name):
    problem, goal = begin(segments, start, seed), GOALS[name]
    best, best_straight = least(problem, goal), least(problem)
    for method in METHODS:
        result = solve(problem, method=method, effort="quick", objective=goal)
        flips = result.flipped
        assert sequence_cost(goal, segments, result.order, flips) == pytest.approx(result.cost, abs=1e-7)
        assert result.cost >= best - 1e-7
        assert result.lower_bound_mm is None or result.lower_bound_mm <= best_straight + 1e-9
        if method in ("exact", "auto"):
            assert result.cost == pytest.approx(best, abs=1e-7)


@contextmanager
def blocks_of(seed):
    """Two columns to a block of the bound for every third seed; a small sheet is one block otherwise."""
    with pytest.MonkeyPatch.context() as patch:
        if seed % 3 == 0:
            patch.setattr("slicer.sequence.states.corridor.MERGED_STATES", 0)
        yield patch


class Stop:
    """Hears of progress, keeps what it hears, and presses Ctrl-C at the k-th word."""

    def __init__(self, k):
        self.k, self.said = k, []

    def __call__(self, word):
        self.said.append(word)
        if len(self.said) == self.k:
            raise KeyboardInterrupt


@settings(max_examples=80, deadline=None)
@given(
    seeds,
    starts,
    st.sampled_from(PROVING),
    st.integers(1, 12),
    st.sampled_from(["straight", "straight", "time", "routed"]),
)
def test_wherever_a_proof_is_stopped_its_bound_holds(sheet, seed, start, method, stop, name):
    goal = GOALS[name]
    problem = begin(sheet(seed, 8 if name == "straight" else 6, 2), start, seed)
    hear = Stop(stop)
    initial = dear_start(problem, goal, seed)
    with blocks_of(seed):
        found = searched(METHODS[method], problem, objective=goal, initial=initial, progress=hear)
    best = least(problem, goal)
    assert found.lower_bound <= best + 1e-7
    assert found.straight_bound_mm <= least(problem) + 1e-9
    for word in hear.said:
        assert word.lower_bound is None or word.lower_bound <= best + 1e-7
        assert word.cost >= best - 1e-7


@settings(max_examples=120, deadline=None)
@given(seeds, starts, st.sampled_from(["straight", "time", "routed"]), st.integers(1, 3), st.booleans())
@example(175, (True, None), "time", 3, False)  # what comes after a layer has been cut counts as cut off too
def test_what_a_narrow_search_cuts_off_is_not_below_its_bound(sheet, seed, start, name, width, noise):
    goal = GOALS[name]
    problem = begin(sheet(seed, 8 if name == "straight" else 6, 3), start, seed)
    initial = dear_start(problem, goal, seed)
    section = Section.whole(problem, goal)
    with blocks_of(seed):
        corridor = widest_corridor(section, initial >> 1, 10**6)
    assert corridor.complete
    bound = PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed)
    if noise:
        bound.best += np.random.default_rng(seed).normal(0.0, 0.5, len(bound.best))
    bound.use_best_multipliers()
    found = search_layers(Search(problem, objective=goal), bound, np.inf, width)
    best = least(problem, goal)
    assert found.finished
    assert found.cost >= best - 1e-7
    assert min(found.cost, found.lower_bound) <= best + 1e-7


@settings(max_examples=40, deadline=None)
@given(seeds, starts)
def test_a_beam_too_narrow_for_the_optimum_claims_no_more(sheet, seed, start):
    problem = begin(sheet(seed, 10, 8), start, seed)
    initial = dear_start(problem, STRAIGHT, seed)
    random = np.random.default_rng(seed)

    def mislead(search, bound, budget, steps, *, complete):
        """In place of an ascent: any multipliers bound the optimum, these guide the search badly."""
        bound.best += random.normal(0.0, 0.5, len(bound.best))
        bound.use_best_multipliers()

    with blocks_of(0) as patch:
        patch.setattr("slicer.sequence.layered.beam_search.raise_bound", mislead)
        patch.setattr("slicer.sequence.layered.beam_search.PASSES", {"quick": ((1, 1, False), (2, 2, False))})
        patch.setattr("slicer.sequence.layered.beam_search.LEAST_WIDTH", 1)
        found = searched(METHODS["beam"], problem, effort="quick", initial=initial)
    best = least(problem)
    assert problem.travel_mm(found.oriented >> 1, found.oriented & 1) >= best - 1e-9
    assert found.lower_bound <= best + 1e-9


DEGENERATE = {
    "none": ([], 0.0),
    "one": ([line(0, 0, 1, 0)], 0.0),
    "two in a chain": ([line(0, 0, 1, 0), line(0, 1, 1, 1)], 1.0),
    "two apart": ([line(0, 0, 1, 0), line(3, 0, 4, 0)], 2.0),
    # A row of tiles: along the lower lines, up once, and back along the upper ones.
    "one row": ([line(k, y, k + 1, y) for y in (0, 1) for k in range(4)], 1.0),
    "one row of single lines, tilted": ([line(2 * k, 0, 2 * k + 1, 1) for k in range(5)], 4 * 2**0.5),
    "one column": ([line(0, k, 1, k + 0.5) for k in range(7)], 6.0),
    # Three lines at 45 degrees: a corner, the diagonal, the other corner, up each time by the spacing.
    "one tile": ([line(1, 0, 2, 1), line(0, 0, 2, 2), line(0, 1, 1, 2)], 2 * 1.0),
    "all horizontal": ([line(0, k, 1, k) for k in range(8)], 7.0),
    "all vertical": ([line(k, 0, k, 1) for k in range(6)], 5.0),
    "verticals on top of each other": ([line(0, k, 0, k + 0.5) for k in range(6)], 2.5),
    # From the lower end of an odd line to the next is √(0.1² + 0.3²), from the others 0.1.
    "an antichain": ([line(k, 0, k + 0.9, 0.3 * (k % 2)) for k in range(6)], 3 * 0.1 + 2 * 0.1**0.5),
    "identical endpoints": (
        [line(k, 0, k + 1, 0) for k in range(5)] + [line(0, 0, 0, 1), line(0, 1, 1, 1)],
        0.0,
    ),
    "a chain and one beside it": ([line(0, k, 1, k) for k in range(7)] + [line(2, 0, 3, 0)], 7.0),
}


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_sheets(name, goal):
    lines, by_hand = DEGENERATE[name]
    segments, objective = np.array(lines, float).reshape(-1, 2, 2), GOALS[goal]
    best_straight, best = least_cost(STRAIGHT, segments), least_cost(objective, segments)
    assert best_straight == pytest.approx(by_hand, abs=1e-9)
    low, high = np.nonzero(relation(segments))
    for method in METHODS:
        result = solve(segments, first=None, method=method, effort="quick", objective=objective)
        assert sorted(result.order.tolist()) == list(range(len(segments)))
        position = np.argsort(result.order)
        assert (position[low] < position[high]).all()
        assert result.cost == pytest.approx(
            sequence_cost(objective, segments, result.order, result.flipped), abs=1e-9
        )
        assert result.cost >= best - 1e-9
        assert result.lower_bound_mm is None or result.lower_bound_mm <= by_hand + 1e-9
        if method in ("exact", "auto"):
            assert result.cost == pytest.approx(best, abs=1e-9)
            assert result.proved or goal != "straight"
