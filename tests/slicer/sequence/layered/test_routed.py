"""Travels over what is printed: the same cost however it is computed, and optimal where it is proved."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies
from exhaustive import least_cost
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import searched

from slicer import generate, travel
from slicer.hatch import hatch
from slicer.nozzle import POINT, NozzleBody
from slicer.sequence import Problem
from slicer.sequence.construct.hill_climbing import greedy
from slicer.sequence.layered.beam_search import beam
from slicer.sequence.layered.exact_search import exact
from slicer.sequence.layered.windows import window_search
from slicer.sequence.problem.objective import CostModel, Objective
from slicer.sequence.problem.search import Search
from slicer.sequence.problem.sequence_cost import true_cost
from slicer.sequence.problem.travel_cost import leg_cost
from slicer.sequence.states import section_cost
from slicer.sequence.states.column_skylines import skylines
from slicer.sequence.states.downsets import any_order, down_sets
from slicer.sequence.states.ground import Ground
from slicer.sequence.states.section import Section, extents

ROUTED = Objective("routed", 0.2)
BODY = NozzleBody(0.1, 0.5, np.inf, 0.0, 0.0, np.inf, np.inf)
TIME = Objective("time", 0.2, (20.0, 20.0, 2.0), (500.0, 500.0, 30.0), fixed_s=0.05, fixed_from_mm=0.3)


def printable(problem: Problem, seed: int) -> np.ndarray:
    """A random printable sequence that begins as the problem wants."""
    random = np.random.default_rng(seed)
    missing = np.diff(problem.pred_start)
    ready = np.flatnonzero(missing == 0).tolist()
    sequence: list[int] = []
    while ready:
        s = ready.pop(random.integers(len(ready)))
        sequence.append(2 * s + int(random.integers(2)))
        for t in problem.succ[problem.succ_start[s] : problem.succ_start[s + 1]]:
            missing[t] -= 1
            if missing[t] == 0:
                ready.append(int(t))
    return np.array(sequence, np.int32)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), clearance=st.sampled_from([0.0, 0.3]), body=st.just(POINT) | bodies())
def test_three_ways_to_cost_a_sequence_agree(sheet, seed, clearance, body):
    # With a body too, printable or not: what a travel costs is not what may be printed.
    problem = replace(Problem.build(sheet(seed, 40)), body=body)
    oriented = printable(problem, seed)
    plan = travel.plan(problem.segments, oriented >> 1, oriented & 1, clearance_mm=clearance, body=body)
    timed = replace(TIME, clearance_mm=clearance)
    # Seconds as well: where points in line were told apart by rounding, each was a stop of no length.
    for objective, planned in (
        (Objective("routed", clearance), plan.routed_mm),
        (timed, seconds(plan, timed.cost_model)),
    ):
        assert true_cost(problem, objective, oriented) == pytest.approx(planned, abs=1e-7)
        section = Section.whole(problem, objective)
        sets = down_sets(section, 5, oriented >> 1)  # a corridor around this very order
        assert section_cost(section, sets, skylines(section, sets), oriented) == pytest.approx(
            planned, abs=1e-7
        )


def seconds(plan: travel.Plan, model: CostModel) -> float:
    """The time of all travels of a plan, leg by leg."""
    total = 0.0
    for k in range(1, len(plan.toolpaths)):
        via = plan.via[plan.via_start[k] : plan.via_start[k + 1]]
        steps = np.diff(np.vstack([plan.toolpaths[k - 1, 1], via, plan.toolpaths[k, 0]]), axis=0)
        length = np.hypot(*steps.T)
        total += sum(leg_cost(model, *step) for step in steps[length > 1e-9])
        total += model.fixed if length.sum() > model.fixed_from else 0.0
    return total


@pytest.mark.parametrize("rounding", [-3e-16, 0.0, 3e-16])
@pytest.mark.parametrize("body", [POINT, BODY], ids=["point", "body"])
def test_points_in_line_hold_no_travel_up(body, rounding):
    walls = [[[2.0, 0.0], [2.0, 1.1]], [[2.6, 0.0], [2.6, 1.1 + rounding]], [[3.0, 0.0], [3.0, 1.1]]]
    ends = [[[0.0, 0.0], [1.0, 0.0]], [[4.0, 0.0], [5.0, 0.0]]]
    last = []
    for between in (walls, walls[::2]):
        problem = replace(Problem.build(np.array(between + ends)), body=body)
        oriented = 2 * np.arange(problem.n, dtype=np.int32)
        section = Section.whole(problem, TIME)
        sets = down_sets(section, 100)
        sky = skylines(section, sets)
        for order, sign in ((oriented, 1.0), (oriented[:-1].copy(), -1.0)):
            last.append(
                sign * np.array([true_cost(problem, TIME, order), section_cost(section, sets, sky, order)])
            )
    expected = (last[0] + last[1])[0]
    assert [*(last[0] + last[1]), *(last[2] + last[3])] == pytest.approx([expected] * 4, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), data=st.data(), body=st.just(POINT) | bodies())
def test_a_window_costs_what_its_part_of_the_sequence_does(sheet, seed, data, body):
    problem = replace(Problem.build(sheet(seed, 40, 4)), body=body)
    oriented = printable(problem, seed)
    begin = data.draw(st.integers(0, problem.n - 2))
    end = data.draw(st.integers(begin + 2, problem.n))
    horizon = Ground(problem.segments, body)
    horizon.print(oriented[:begin])
    for objective in (ROUTED, TIME):
        window = Section.window(problem, objective, oriented, begin, end, horizon.pieces(), extents(problem))
        sets = down_sets(window, 5, np.arange(window.n, dtype=np.int32))
        inner = (2 * np.arange(window.n) + (oriented[begin:end] & 1)).astype(np.int32)
        up_to = [true_cost(problem, objective, oriented[:k]) for k in (begin + 1, end)]
        assert section_cost(window, sets, skylines(window, sets), inner) == pytest.approx(
            up_to[1] - up_to[0], abs=1e-7
        )


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    free=st.booleans(),
    flipped=st.sampled_from([None, False, True]),
    objective=st.sampled_from([ROUTED, TIME]),
)
def test_exact_and_a_window_over_everything_equal_brute_force(sheet, seed, free, flipped, objective):
    segments = sheet(seed, 7)
    problem = Problem.build(segments, first=None if free else 0, first_flipped=flipped)
    best = least_cost(objective, segments, first=problem.first, first_flipped=flipped)
    found = searched(exact, problem, objective=objective)
    assert true_cost(problem, objective, found.oriented) == pytest.approx(best, abs=1e-7)
    assert flipped in (None, bool(found.oriented[0] & 1))
    assert found.proved
    assert found.straight_bound_mm == 0.0
    start = searched(greedy, problem).oriented
    polished = window_search(Search(problem, objective=objective), start, length=7)
    assert true_cost(problem, objective, polished) == pytest.approx(best, abs=1e-7)


@pytest.mark.parametrize("objective", [ROUTED, TIME], ids=["routed", "time"])
def test_aiming_at_an_objective_serves_it_best(objective):
    problem = Problem.build(hatch(generate.random_walk(3, 3, seed=7)).segments, first=0)
    straight = searched(exact, problem).oriented
    for method in (exact, beam):
        aimed = searched(method, problem, objective=objective).oriented
        assert problem.refusal(aimed >> 1) is None
        assert true_cost(problem, objective, aimed) <= true_cost(problem, objective, straight)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-50, 50).map(lambda mm: round(mm, 6)), min_size=4, max_size=4))  # above EPS_MM
def test_two_legs_take_no_less_time_than_one(legs):
    cost_model = TIME.cost_model
    ax, ay, bx, by = legs
    detour = leg_cost(cost_model, ax, ay) + leg_cost(cost_model, bx, by)
    assert leg_cost(cost_model, ax + bx, ay + by) <= detour * (1 + 1e-9) + 1e-9


def test_any_order_is_printable(sheet):
    for seed in range(30):
        problem = Problem.build(sheet(seed, 30))
        assert problem.refusal(any_order(Section.whole(problem, Objective()))) is None
