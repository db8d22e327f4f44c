"""Promises that every method keeps, and the options of ``solve``."""

import importlib.util
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.errors import SequenceError
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.cost import Objective
from slicer.sequence.true_cost import true_cost
from tests.fields import random_extension, relation, segment_sets

DATA = Path(__file__).parents[1] / "data" / "reference"
MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]
methods = st.sampled_from(sorted(METHODS))


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


DEGENERATE = {
    "none": [],
    "one": [line(0, 0, 1, 0)],
    "two": [line(0, 0, 1, 0), line(0, 1, 1, 1)],
    "all horizontal": [line(0, k, 1, k) for k in range(8)],
    "all vertical": [line(k, 0, k, 1) for k in range(8)],
    "verticals on top of each other": [line(0, k, 0, k + 0.5) for k in range(6)],
    "an antichain": [line(k, 0, k + 0.9, 0.3 * (k % 2)) for k in range(9)],
    "identical endpoints": [line(k, 0, k + 1, 0) for k in range(5)] + [line(0, 0, 0, 1), line(0, 1, 1, 1)],
    "a chain and one beside it": [line(0, k, 1, k) for k in range(7)] + [line(2, 0, 3, 0)],
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_sheets(name, method):
    segments = np.array(DEGENERATE[name], float).reshape(-1, 2, 2)
    for goal in GOALS:
        result = solve(segments, first=None, method=method, effort="quick", objective=goal)
        assert sorted(result.order.tolist()) == list(range(len(segments)))
        assert result.lower_bound_mm is None or result.lower_bound_mm <= result.travel_mm
    if name == "all horizontal":
        assert result.travel_mm == pytest.approx(7.0)


@given(segment_sets(max_n=60), methods, st.integers(0, 99), st.sampled_from(GOALS), st.booleans())
@settings(max_examples=60, deadline=None)
def test_every_method_keeps_its_promises(segments, method, seed, goal, free):
    problem = Problem.build(segments, first=None)
    n = problem.n
    if n and not free:
        problem = Problem.build(segments, first=int(problem.starts[0]) >> 1, first_flipped=bool(seed % 2))
    start = random_extension(np.random.default_rng(seed), n, problem.edges)
    if n and not free:
        start = np.concatenate([[problem.first], start[start != problem.first]])
    options = {"method": method, "effort": "quick", "seed": seed, "objective": goal, "initial": start}
    result = solve(problem, **options)
    assert sorted(result.order.tolist()) == list(range(n))
    position = np.argsort(result.order)
    low, high = np.nonzero(relation(problem.segments))
    assert (position[low] < position[high]).all()
    if n and not free:
        assert result.order[0] == problem.first
        assert result.flipped[0] == problem.first_flipped
    ends = problem.segments[result.order, 1 - result.flipped.astype(int)]
    begins = problem.segments[result.order, result.flipped.astype(int)]
    assert result.travel_mm == pytest.approx(np.hypot(*(begins[1:] - ends[:-1]).T).sum(), abs=1e-9)
    oriented = (2 * result.order + result.flipped).astype(np.int32)
    assert result.cost == pytest.approx(true_cost(problem, goal, oriented), abs=1e-9)
    if result.lower_bound_mm is not None:
        assert result.lower_bound_mm <= result.travel_mm + 1e-9
    for flips in (False, True):
        if free or not n or flips == problem.first_flipped:
            given_start = (2 * start + flips).astype(np.int32)
            assert result.cost <= true_cost(problem, goal, given_start) + 1e-9
    again = solve(problem, **options)
    assert np.array_equal(again.order, result.order)
    assert np.array_equal(again.flipped, result.flipped)


@given(segment_sets(max_n=7))
@settings(max_examples=30, deadline=None)
def test_no_method_beats_all_linear_extensions(segments):
    problem = Problem.build(segments, first=None)
    if problem.n == 0:
        return
    low, high = problem.edges.T
    best = np.inf
    for order in itertools.permutations(range(problem.n)):
        position = np.argsort(order)
        if (position[low] < position[high]).all():
            for flips in itertools.product([0, 1], repeat=problem.n):
                best = min(best, problem.travel_mm(order, flips))
                if problem.n > 5:
                    break
    for method in METHODS:
        result = solve(problem, method=method, effort="quick")
        if problem.n <= 5:
            assert result.travel_mm >= best - 1e-9
            assert result.lower_bound_mm is None or result.lower_bound_mm <= best + 1e-9
        else:
            assert result.lower_bound_mm is None or result.lower_bound_mm <= best + 1e-9


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["2x2_s1", "3x3_s1", "4x4_s1"])
def test_the_independent_scorer_agrees(name, method, score):
    instance = json.loads((DATA / f"{name}.json").read_text())
    segments = np.array(instance["segments"], float)
    result = solve(segments, first=instance["first"], method=method, effort="quick")
    order = list(zip(result.order.tolist(), result.flipped.tolist(), strict=True))
    assert score(segments, instance["first"], order) == pytest.approx(result.travel_mm, abs=1e-6)


@pytest.mark.parametrize("name", ["2x2_s1", "3x3_s1", "4x4_s1"])
def test_auto_proves_small_sheets(name, reference):
    problem, known = reference(name)
    result = solve(problem)
    assert result.proved
    assert result.travel_mm == pytest.approx(known, abs=1e-4)


def test_progress_never_rises(reference):
    problem, _ = reference("6x6_s1")
    said = []
    result = solve(problem, method="local", effort="quick", progress=said.append)
    costs = [word.cost for word in said]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(result.travel_mm)


def test_workers_are_deterministic_and_no_worse_than_one(reference):
    problem, _ = reference("4x4_s1")
    one, two, again = (
        solve(problem, method="aco", effort="quick", workers=workers, seed=3) for workers in (1, 2, 2)
    )
    assert two.travel_mm <= one.travel_mm
    assert np.array_equal(two.order, again.order)


@pytest.mark.parametrize("objective", ["straight", "routed", "time"])
def test_no_objective_is_better_served_by_another(objective, reference):
    problem, _ = reference("3x3_s1")
    goal = Objective(objective, **MACHINE)
    own = solve(problem, effort="quick", objective=goal)
    for other in GOALS:
        result = solve(problem, effort="quick", objective=other)
        oriented = (2 * result.order + result.flipped).astype(np.int32)
        assert own.cost <= true_cost(problem, goal, oriented) + 1e-9


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "magic"}, "there is no method 'magic'"),
        ({"effort": "heroic"}, "there is no effort 'heroic'"),
        ({"objective": "beauty"}, "there is no objective 'beauty'"),
        ({"time_limit_s": -1.0}, "must be at least 0"),
        ({"workers": 0}, "workers 0 must be at least 1"),
        ({"initial": [0, 1]}, "shape"),
        ({"initial": [0, 0, 1]}, "exactly once"),
        ({"initial": [0.0, 1.0, 2.0]}, "whole numbers"),
        ({"initial": [2, 1, 0]}, "begins with toolpath 2, not 0"),
        ({"initial": [0, 2, 1]}, "toolpath 1 lies below 2"),
        ({"initial": ([0, 1, 2], [True])}, "directions"),
    ],
)
def test_wrong_use_is_refused_in_words(options, words):
    segments = np.array([line(0, k, 1, k) for k in range(3)], float)
    with pytest.raises(SequenceError, match=words):
        solve(segments, **options)


@pytest.fixture(scope="module")
def score():
    """The scorer that shares no code with the package."""
    path = Path(__file__).parents[3] / "shared" / "reference" / "score.py"
    if not path.exists():
        pytest.skip("the independent scorer is not beside this checkout")
    spec = importlib.util.spec_from_file_location("score", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.score
