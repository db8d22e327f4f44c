"""A search keeps the best sequence and bound, in the unit of its objective, whoever found them."""

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.problem import Objective, Search

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (20.0, 20.0, 2.0), "acceleration_mm_s2": (500.0, 500.0, 30.0)}
STRAIGHT, ROUTED, TIME = Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)


@pytest.fixture(name="problem")
def _problem():
    return Problem.build(hatch(random_walk(2, 2, seed=1)).segments, first=0)


def sequences(problem):
    """A dear sequence and a cheap one."""
    dear, cheap = solve(problem, method="greedy"), solve(problem, method="exact")
    return [(2 * one.order + one.flipped).astype(np.int32) for one in (dear, cheap)]


def test_only_what_is_cheaper_is_taken(problem):
    dear, cheap = sequences(problem)
    search = Search(problem, initial=dear)
    assert search.offer(cheap)
    assert not search.offer(dear)
    assert not search.offer(cheap)
    assert search.oriented is cheap
    assert search.cost == pytest.approx(problem.travel_mm(cheap >> 1, cheap & 1))


def test_without_a_sequence_it_says_so(problem):
    search = Search(problem)
    assert not search.started
    assert not search.proved
    with pytest.raises(AssertionError, match="no sequence yet"):
        _ = search.oriented


def test_a_bound_never_passes_the_cost_and_never_falls(problem):
    dear, _ = sequences(problem)
    search = Search(problem, initial=dear)
    search.raise_bound(3.0)
    search.raise_bound(2.0)
    assert search.lower_bound == search.straight_bound_mm == 3.0
    assert not search.proved
    search.raise_bound(1e9)
    assert search.lower_bound == search.cost
    assert search.proved


def test_whose_bounds_hold_for_whom():
    assert STRAIGHT.relaxes(STRAIGHT)
    assert STRAIGHT.relaxes(ROUTED)
    assert not ROUTED.relaxes(STRAIGHT)
    assert not STRAIGHT.relaxes(TIME)
    assert not ROUTED.relaxes(TIME)
    assert not Objective("time", fixed_s=1.0).relaxes(TIME)


@pytest.mark.parametrize(("goal", "holds"), [(STRAIGHT, True), (ROUTED, True), (TIME, False)])
def test_what_a_surrogate_finds_is_taken_in_and_its_bound_where_it_holds(problem, goal, holds):
    dear, cheap = sequences(problem)
    search = Search(problem, objective=goal, initial=dear)
    inner = search.surrogate("straight")
    inner.offer(cheap)
    inner.raise_bound(4.0)
    inner.nodes_visited, inner.stopped = 7, True
    search.absorb(inner.outcome())
    assert search.oriented is cheap
    assert search.lower_bound == (4.0 if holds else 0.0)
    assert search.straight_bound_mm == 4.0
    assert (search.nodes_visited, search.stopped) == (7, True)


def test_a_surrogate_gets_its_share_of_the_time_that_is_left(problem):
    search = Search(problem, deadline=1e12)
    assert search.surrogate("straight").deadline == 1e12
    assert 0.4e12 < search.surrogate("straight", share=0.5).deadline < 0.6e12
    assert search.apart(3).deadline is None


def test_time_that_is_up_is_remembered_unless_all_is_proved(problem):
    dear, _ = sequences(problem)
    for proved in (False, True):
        search = Search(problem, initial=dear, deadline=0.0)
        if proved:
            search.raise_bound(1e9)
        assert search.should_stop()
        assert search.stopped is not proved


@pytest.mark.parametrize("goal", [STRAIGHT, ROUTED, TIME], ids=lambda goal: goal.name)
def test_a_proof_is_told_in_the_unit_of_the_objective(problem, goal):
    result = solve(problem, objective=goal)
    assert result.unit == goal.unit == ("s" if goal is TIME else "mm")
    assert result.proved
    assert result.lower_bound == pytest.approx(result.cost)
    assert result.gap == 0.0
    assert result.travel_proved == (goal is STRAIGHT or result.travel_mm == result.lower_bound_mm)
    assert f"{result.cost:.4f} {goal.unit} (optimal)" in result.summary()


@pytest.mark.parametrize(
    ("objective", "effort", "part", "pays"),
    [
        (TIME, "default", 0.98, False),  # 2 % of a few seconds is less than a second of work
        (TIME, "default", 0.0, True),  # nothing is known of what can be gained
        (TIME, "high", 0.98, True),
        (STRAIGHT, "default", 0.98, True),  # millimetres are no seconds
        (ROUTED, "default", 0.98, True),
    ],
)
def test_a_stage_that_takes_longer_than_what_it_may_gain_does_not_pay(problem, objective, effort, part, pays):
    search = Search(problem, objective=objective, effort=effort, initial=sequences(problem)[1])
    search.raise_bound(part * search.cost)
    assert search.pays(0.02 * search.cost) is pays


def test_a_stage_that_may_gain_more_than_it_takes_pays(problem):
    search = Search(problem, objective=TIME, initial=sequences(problem)[1])
    search.raise_bound(0.5 * search.cost)
    assert search.pays(0.2 * search.cost)
    assert not search.pays(0.3 * search.cost)
