"""The optimum over all states of a sheet: against rounds of bound and search, and where it ends early."""

import time
from dataclasses import replace

import numpy as np
import pytest
from searching import searched

from slicer import generate
from slicer.cutting import cut
from slicer.hatch import hatch
from slicer.nozzle import POINT, NozzleBody
from slicer.sequence import Problem
from slicer.sequence.construct import start_greedily
from slicer.sequence.layered import dynamic_programme
from slicer.sequence.layered.bounded_search import bound_around
from slicer.sequence.layered.exact_search import exact
from slicer.sequence.problem import Objective, Search, true_cost

TIME = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0))
JOINED = replace(TIME, fixed_s=0.05, fixed_from_mm=0.3, join_mm=0.6, join_speed_mm_s=2.0)
GOALS = {"routed": Objective("routed", 0.1), "time": TIME, "joined": JOINED}
NEEDLE = NozzleBody.of(0.25, press_mm=0.02)


def walk(cols, rows, seed, body=NEEDLE):
    """A random walk's sheet under a body, cut as it must be, whose first toolpath is fixed."""
    segments = hatch(generate.random_walk(cols, rows, seed=seed)).segments
    if not body.is_point:
        segments = cut(segments, body).segments
    return Problem.build(segments, body=body, first=int(Problem.build(segments, body=body).starts[0] >> 1))


def stages(problem, goal, **options):
    """What ``exact`` comes to, and the stages that it tells of."""
    told = []
    found = searched(exact, problem, objective=goal, progress=lambda word: told.append(word.stage), **options)
    return found, told


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize(
    ("cols", "rows", "body"),
    [(3, 3, NEEDLE), (4, 3, NEEDLE), (4, 4, NozzleBody.of(0.4, press_mm=0.05)), (2, 3, POINT)],
    ids=["3x3", "4x3", "4x4 under a wide tip", "two columns under a point"],
)
def test_it_ends_where_rounds_of_bound_and_search_end(monkeypatch, cols, rows, body, goal):
    for seed in (1, 2):
        problem = walk(cols, rows, seed, body)
        found, told = stages(problem, GOALS[goal])
        assert told[-1] == "all states"
        with monkeypatch.context() as patch:
            patch.setattr("slicer.sequence.layered.exact_search.holds_whole", lambda bound: False)
            rounds, told = stages(problem, GOALS[goal])
        assert "all states" not in told
        assert found.proved
        assert rounds.proved
        assert found.cost == pytest.approx(rounds.cost, rel=1e-9)
        assert problem.refusal(found.oriented >> 1) is None


def test_it_finds_what_no_beam_has_led_to(monkeypatch):
    problem = walk(4, 4, 1)
    led, _ = stages(problem, TIME)
    monkeypatch.setattr(dynamic_programme, "_offer_beam", lambda search, bound, width: None)
    alone, _ = stages(problem, TIME)
    assert alone.proved
    assert alone.cost == pytest.approx(led.cost, rel=1e-9)
    assert alone.cost == true_cost(problem, TIME, alone.oriented)


def test_from_a_nearly_optimal_sequence_it_finds_the_optimum(monkeypatch):
    """Where little is left to gain, much is left out."""
    above = []
    for seed in range(1, 6):
        problem = walk(4, 3, seed)
        optimum = stages(problem, TIME)[0].cost
        for width in (1, 2, 5):
            monkeypatch.setattr(dynamic_programme, "WIDTH", width)
            told = {}
            found = searched(
                exact,
                problem,
                objective=TIME,
                progress=lambda word, told=told: told.update({word.stage: word}),
            )
            above.append(told["search"].cost / optimum - 1.0)
            assert found.proved
            assert found.cost == pytest.approx(optimum, rel=1e-9)
    assert sum(1e-4 < part < 0.03 for part in above) >= 3


def test_of_an_optimal_sequence_it_proves_that_nothing_is_below():
    problem = walk(4, 3, 1)
    best, _ = stages(problem, TIME)
    again, told = stages(problem, TIME, initial=best.oriented)
    assert told[-1] == "all states"
    assert again.proved
    assert (again.oriented == best.oriented).all()


def test_a_travel_is_priced_over_what_its_state_has():
    problem = walk(3, 3, 1)
    search = Search(problem, objective=TIME)
    search.offer(stages(problem, TIME)[0].oriented)
    opened = bound_around(search, 40_000)
    assert opened is not None
    bound, complete = opened
    assert complete
    assert dynamic_programme.holds_whole(bound)
    bound.use_best_multipliers()
    assert bound.bound < search.cost * (1.0 - 1e-3)  # as if travels went straight
    dynamic_programme.prove_over_all_states(search, bound)
    assert search.proved


def test_what_comes_before_is_never_rounded_up(monkeypatch):
    seen = []
    come_back = dynamic_programme._come_back

    def watched(blocks, travels, least, *rest):
        seen.append(float(least.before[blocks.value_start[-2] :].min()))
        come_back(blocks, travels, least, *rest)

    monkeypatch.setattr(dynamic_programme, "_come_back", watched)
    for seed in range(1, 6):
        told = {}
        searched(
            exact,
            walk(4, 4, seed),
            objective=TIME,
            progress=lambda word, told=told: told.update({word.stage: word}),
        )
        bound = told["bound"].lower_bound
        assert 0.0 <= bound - seen[-1] < 1e-4 * bound


def test_of_two_that_differ_by_a_hair_the_quicker_one_is_proved(monkeypatch):
    """What comes before is a sum of hundreds of equal travels, whose rounding errors are alike."""
    height = 0.1 * np.arange(600)
    segments = np.stack([np.stack([x * np.ones(600), height], axis=1) for x in (0.0, 1.0)], axis=1)
    segments[-1, :, 0] = 0.0199, 0.98  # nearly as far from either end of the one below
    problem = Problem.build(segments)
    goal = Objective("routed", 0.1)
    best, _ = stages(problem, goal)
    monkeypatch.setattr(dynamic_programme, "_offer_beam", lambda search, bound, width: None)
    turned, told = stages(problem, goal, initial=best.oriented ^ 1)
    assert true_cost(problem, goal, best.oriented ^ 1) > best.cost
    assert told[-1] == "all states"
    assert turned.proved
    assert turned.cost == pytest.approx(best.cost, rel=1e-12)


@pytest.mark.parametrize("looks", range(4))
def test_out_of_time_it_keeps_the_best_and_a_bound(monkeypatch, looks):
    problem = walk(4, 4, 1)
    optimum = stages(problem, TIME)[0].cost
    monkeypatch.setattr(dynamic_programme, "AT_ONCE", 1_000)
    asked = []

    def late(search):
        asked.append(search)
        return len(asked) > looks

    search = Search(problem, objective=TIME)
    start_greedily(search)
    opened = bound_around(search, 40_000)
    assert opened is not None
    monkeypatch.setattr(Search, "should_stop", late)
    dynamic_programme.prove_over_all_states(search, opened[0])
    assert not search.proved
    assert 0.0 < search.lower_bound <= optimum <= search.cost


def test_where_too_much_is_left_nothing_false_is_claimed(monkeypatch):
    problem = walk(4, 4, 1)
    optimum = stages(problem, TIME)[0].cost
    monkeypatch.setattr(dynamic_programme, "MOST_LEFT", {"default": 100})
    found, told = stages(problem, TIME)
    assert "all states" not in told
    assert not found.proved
    assert 0.0 < found.lower_bound <= optimum <= found.cost
    assert found.cost < 1.05 * optimum  # a wider beam makes up for it


def test_straight_travel_has_no_use_for_it():
    _, told = stages(walk(3, 3, 1), Objective())
    assert "all states" not in told


def test_more_may_be_looked_at_where_one_block_holds_the_sheet(monkeypatch):
    problem = walk(4, 4, 1)
    few = {"default": 100}
    monkeypatch.setattr("slicer.sequence.layered.exact_search.ARCS_PER_TOOLPATH", few)
    monkeypatch.setattr("slicer.sequence.layered.bounded_search.WHOLE", {"default": 1})
    assert "all states" not in stages(problem, TIME)[1]
    monkeypatch.setattr("slicer.sequence.layered.bounded_search.WHOLE", {"default": 10_000})
    problem = walk(4, 4, 1)
    assert "all states" in stages(problem, TIME)[1]


def test_under_a_deadline_no_more_is_held_than_there_is_time_for(monkeypatch):
    few = {"default": 100}
    monkeypatch.setattr("slicer.sequence.layered.exact_search.ARCS_PER_TOOLPATH", few)
    monkeypatch.setattr("slicer.sequence.layered.bounded_search.WHOLE", {"default": 10_000})
    deadline = time.perf_counter() + 3600.0
    assert "all states" in stages(walk(4, 4, 1), TIME, deadline=deadline)[1]
    monkeypatch.setattr("slicer.sequence.layered.bounded_search.ARCS_PER_SECOND", 1)
    found, told = stages(walk(4, 4, 1), TIME, deadline=deadline)
    assert "all states" not in told
    assert found.lower_bound > 0.0
