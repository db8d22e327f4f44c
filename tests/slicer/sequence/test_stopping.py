"""Time limits, Ctrl-C and progress: what every method owes to whoever waits for it."""

import importlib

import numpy as np
import pytest

from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.construct.levels import level_start
from slicer.sequence.problem.neighbour_lists import neighbours
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]
FIRST_CALL = {
    "auto": ("portfolio.automatic", "start_along_levels"),
    "greedy": ("construct.hill_climbing", "hill_climbs"),
    "multistart": ("construct.multi_start", "start_greedily"),
    "local": ("local_search.annealing", "start_along_levels"),
    "beam": ("layered.beam_search", "start_greedily"),
    "exact": ("layered.exact_search", "start_greedily"),
    "mcts": ("tree_search.monte_carlo", "start_along_levels"),
    "aco": ("tree_search.ant_colony", "start_greedily"),
}
"""The module of each method, and what it calls before it has a sequence."""


def module(name):
    """A module of the sequencer."""
    return importlib.import_module(f"slicer.sequence.{name}")


def interrupt(*_, **__):
    raise KeyboardInterrupt


class Clock:
    """Time is up when it is looked at for the ``last``-th time."""

    def __init__(self, last):
        self.last, self.looks = last, 0

    def __call__(self, *_):
        self.looks += 1
        return self.looks >= self.last


def counted(monkeypatch, where, name):
    """Count the calls of a function of a module."""
    calls = []
    called = getattr(where, name)

    def count(*arguments, **named):
        calls.append(arguments)
        return called(*arguments, **named)

    monkeypatch.setattr(where, name, count)
    return calls


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.name)
@pytest.mark.parametrize("method", METHODS)
def test_a_tiny_time_limit_gives_a_valid_order_and_says_so(method, goal, reference):
    problem, _ = reference("10x10_s1")
    result = solve(problem, method=method, time_limit_s=1e-9, objective=goal)
    assert result.stopped
    assert "stopped early" in result.summary()
    assert problem.refusal(result.order) is None


@pytest.mark.parametrize("goal", GOALS[:2], ids=lambda goal: goal.name)
@pytest.mark.parametrize("method", METHODS)
def test_ctrl_c_returns_the_best_so_far(method, goal, reference):
    problem, _ = reference("10x10_s1")
    said = []

    def interrupt_at_once(word):
        said.append(word)
        if len(said) == 1:
            raise KeyboardInterrupt

    result = solve(problem, method=method, objective=goal, progress=interrupt_at_once)
    assert said[0].stage != "end"
    assert result.stopped
    assert result.cost <= said[0].cost + 1e-9
    assert problem.refusal(result.order) is None


@pytest.mark.parametrize("method", METHODS)
def test_ctrl_c_before_there_is_anything_returns_the_initial_sequence(method, reference, monkeypatch):
    problem, _ = reference("4x4_s1")
    given = solve(problem, method="local", effort="quick")
    where, name = FIRST_CALL[method]
    monkeypatch.setattr(module(where), name, interrupt)
    result = solve(problem, method=method, initial=given)
    assert result.stopped
    assert np.array_equal(result.order, given.order)
    assert np.array_equal(result.flipped, given.flipped)


@pytest.mark.parametrize("method", METHODS)
def test_ctrl_c_before_there_is_anything_returns_what_greedy_finds_first(method, reference, monkeypatch):
    problem, _ = reference("4x4_s1")
    greedy = solve(problem, method="greedy")
    where, name = FIRST_CALL[method]
    real = getattr(module(where), name)
    for goal in GOALS[:2]:
        calls = []

        def once(*given, calls=calls, **named):
            calls.append(given)
            if len(calls) == 1:
                raise KeyboardInterrupt
            return real(*given, **named)

        monkeypatch.setattr(module(where), name, once)
        result = solve(problem, method=method, objective=goal)
        assert calls
        assert result.stopped
        assert problem.refusal(result.order) is None
        assert result.travel_mm == pytest.approx(greedy.travel_mm, rel=0.2)


def test_ctrl_c_while_refining_returns_the_best_so_far(monkeypatch):
    monkeypatch.setattr(module("portfolio.surrogates"), "refine", interrupt)
    segments = np.array([[[c, k], [c + 1, k]] for k in range(3) for c in range(2)], float)
    # Without a bound: what is proved is not refined.
    result = solve(segments, method="local", objective="routed", effort="quick")
    assert result.stopped
    assert Problem.build(segments, first=0).refusal(result.order) is None


def test_ctrl_c_between_two_climbs_keeps_the_first(reference, monkeypatch):
    problem, _ = reference("4x4_s1")
    greedy = module("construct.hill_climbing")
    hill_climb, calls = greedy.hill_climb, []

    def once(*arguments):
        calls.append(arguments)
        return hill_climb(*arguments) if len(calls) == 1 else interrupt()

    monkeypatch.setattr(greedy, "hill_climb", once)
    result = solve(problem, method="greedy")
    assert result.stopped
    assert len(calls) == 2
    assert problem.refusal(result.order) is None


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.name)
@pytest.mark.parametrize("method", METHODS)
def test_every_method_says_how_it_goes_and_last_of_all_what_it_returns(method, goal, reference):
    problem, _ = reference("3x3_s1")
    said = []
    result = solve(problem, method=method, effort="quick", objective=goal, progress=said.append)
    assert not result.stopped
    assert len(said) > 1
    assert said[-1].stage == "end"
    assert said[-1].cost == pytest.approx(result.cost)
    if goal.name == "straight":
        assert [word.cost for word in said] == sorted((word.cost for word in said), reverse=True)
        assert said[-1].lower_bound == pytest.approx(result.lower_bound_mm, rel=1e-12)


def test_ctrl_c_at_the_last_word_returns_the_same_and_says_so(reference):
    problem, _ = reference("3x3_s1")

    def interrupt_at_the_end(word):
        if word.stage == "end":
            raise KeyboardInterrupt

    whole = solve(problem, method="aco", effort="quick")
    result = solve(problem, method="aco", effort="quick", progress=interrupt_at_the_end)
    assert result.stopped
    assert np.array_equal(result.order, whole.order)


# --- the clock is looked at within a pass, not only between passes ---------------------------------------


def test_descent_of_a_whole_sequence_looks_at_the_clock(reference, monkeypatch):
    problem, _ = reference("10x10_s1")
    given = solve(problem, method="greedy")
    start = module("local_search.start")
    monkeypatch.setattr(start, "SLICE", 100)
    slices = counted(monkeypatch, start, "descend")
    monkeypatch.setattr(Search, "late", Clock(3))
    result = solve(problem, method="aco", initial=given)
    assert result.stopped
    assert len(slices) == 3
    assert problem.refusal(result.order) is None


def test_tree_search_looks_at_the_clock_within_a_pass(reference, monkeypatch):
    problem, _ = reference("10x10_s1")
    given = solve(problem, method="greedy")
    slices = counted(monkeypatch, module("tree_search.passes"), "search_stretches")
    monkeypatch.setattr(Search, "late", Clock(2))
    result = solve(problem, method="mcts", initial=given)
    assert result.stopped
    assert len(slices) == 2
    assert result.travel_mm < given.travel_mm
    assert problem.refusal(result.order) is None


def test_the_start_along_levels_looks_at_the_clock(reference, monkeypatch):
    problem, _ = reference("10x10_s1")
    levels = module("construct.levels")
    solved, climbed = counted(monkeypatch, levels, "_solve"), counted(monkeypatch, levels, "_climb")
    hurried = level_start(problem, Objective(), neighbours(problem), lambda: True)
    assert (len(solved), len(climbed)) == (1, 1)
    assert problem.refusal(hurried >> 1) is None
    level_start(problem, Objective(), neighbours(problem))
    assert len(solved) > 2
    assert len(climbed) == 1 + len(levels.WEIGHTS)


def test_slices_change_nothing_where_there_is_no_limit(reference, monkeypatch):
    problem, _ = reference("4x4_s1")
    levels, refine = module("construct.levels"), module("local_search.refinement")
    near, search = neighbours(problem), Search(problem, objective=GOALS[1])
    start = level_start(problem, Objective(), near)
    refined = refine.refine(search, start)
    assert not np.array_equal(refined, start)
    monkeypatch.setattr(levels, "SLICE", 7)
    monkeypatch.setattr(refine, "SLICE", refine.WINDOW)
    assert np.array_equal(level_start(problem, Objective(), near), start)
    assert np.array_equal(refine.refine(search, start), refined)


def test_refinement_looks_at_the_clock_within_a_sweep(reference, monkeypatch):
    problem, _ = reference("4x4_s1")
    refine = module("local_search.refinement")
    monkeypatch.setattr(refine, "SLICE", refine.WINDOW)
    slices = counted(monkeypatch, refine, "_sweep")
    monkeypatch.setattr(Search, "late", Clock(3))
    oriented = next(module("construct.hill_climbing").hill_climbs(Search(problem))).oriented
    refined = refine.refine(Search(problem, objective=GOALS[1]), oriented)
    assert len(slices) == 2
    assert problem.refusal(refined >> 1) is None
