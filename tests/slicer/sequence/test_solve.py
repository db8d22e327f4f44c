"""Promises that every method keeps, and the options of ``solve``."""

import importlib.util
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.sequence_cost import true_cost
from tests.fields import random_extension, relation, segment_sets

DATA = Path(__file__).parents[2] / "data" / "reference"
MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]
methods = st.sampled_from(sorted(METHODS))


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


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
    for flips in (False, True):
        if free or not n or flips == problem.first_flipped:
            given_start = (2 * start + flips).astype(np.int32)
            assert result.cost <= true_cost(problem, goal, given_start) + 1e-9
    again = solve(problem, **options)
    assert np.array_equal(again.order, result.order)
    assert np.array_equal(again.flipped, result.flipped)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["2x2_s1", "3x3_s1", "4x4_s1", "6x6_s1", "10x10_s1"])
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


@pytest.mark.parametrize("goal", GOALS)
def test_no_report_contradicts_the_result(goal, reference):
    problem, _ = reference("3x3_s1")
    for method in METHODS:
        said = []
        result = solve(problem, method=method, effort="quick", objective=goal, progress=said.append)
        costs = [word.cost for word in said]
        assert all(later <= earlier for earlier, later in itertools.pairwise(costs)), method
        assert all(cost >= result.cost - 1e-9 for cost in costs), method
        bounds = [word.lower_bound for word in said if word.lower_bound is not None]
        assert all(bound <= result.cost + 1e-9 for bound in bounds), method


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.name)
@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_gives_the_same_result(method, goal, reference):
    problem, _ = reference("2x2_s1")
    one, two = (solve(problem, method=method, objective=goal, seed=5) for _ in range(2))
    assert np.array_equal(one.order, two.order)
    assert np.array_equal(one.flipped, two.flipped)
    figures = ("travel_mm", "cost", "lower_bound_mm", "nodes_visited", "states_created", "stopped", "seed")
    assert all(getattr(one, name) == getattr(two, name) for name in figures)


@pytest.mark.parametrize("objective", ["straight", "routed", "time"])
def test_no_objective_is_better_served_by_another(objective, reference):
    problem, _ = reference("3x3_s1")
    goal = Objective(objective, **MACHINE)
    own = solve(problem, effort="quick", objective=goal)
    for other in GOALS:
        result = solve(problem, effort="quick", objective=other)
        oriented = (2 * result.order + result.flipped).astype(np.int32)
        assert own.cost <= true_cost(problem, goal, oriented) + 1e-9


@pytest.fixture(scope="module")
def score():
    """The scorer that shares no code with the package."""
    path = Path(__file__).parents[4] / "shared" / "reference" / "score.py"
    if not path.exists():
        pytest.skip("the independent scorer is not beside this checkout")
    spec = importlib.util.spec_from_file_location("score", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.score
