"""Routed objectives: what comes first when time is short, what is told on the way, what is counted."""

import time

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.portfolio import surrogates
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Progress, Search
from slicer.sequence.problem.sequence_cost import true_cost

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (20.0, 20.0, 2.0), "acceleration_mm_s2": (500.0, 500.0, 30.0)}
GOALS = [Objective("routed", **MACHINE), Objective("time", **MACHINE)]


def sheet(seed: int = 1, size: int = 5) -> Problem:
    return Problem.build(hatch(random_walk(size, size, seed=seed, spacing_mm=0.2)).segments, first=0)


@pytest.mark.parametrize("objective", GOALS, ids=lambda objective: objective.name)
@pytest.mark.parametrize("method", ["auto", "local", "exact", "greedy", "aco"])
def test_progress_is_in_the_unit_of_the_goal_and_never_rises(method, objective):
    problem = sheet()
    heard: list[Progress] = []
    result = solve(problem, method=method, effort="quick", objective=objective, progress=heard.append)
    costs = [word.cost for word in heard]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(result.cost)
    for word in heard:
        assert word.cost == pytest.approx(true_cost(problem, objective, word.oriented))
        assert word.lower_bound is None or word.lower_bound <= result.cost + 1e-9


@pytest.mark.parametrize("objective", GOALS, ids=lambda objective: objective.name)
def test_whoever_listens_changes_nothing(objective):
    problem = sheet(2)
    alone = solve(problem, effort="quick", objective=objective)
    heard = solve(problem, effort="quick", objective=objective, progress=lambda _: None)
    assert np.array_equal(alone.order, heard.order)
    assert alone.cost == heard.cost


@pytest.mark.parametrize(("objective", "own"), [(GOALS[0], "straight"), (GOALS[1], "time")])
def test_when_time_is_short_the_own_kind_comes_first(objective, own):
    aimed: list[str] = []

    def method(search: Search) -> None:
        aimed.append(search.objective.name)
        time.sleep(max(0.0, search.deadline - time.perf_counter()))
        assert search.should_stop()

    problem = sheet()
    start = solve(problem, method="greedy")
    oriented = (2 * start.order + start.flipped).astype(np.int32)
    found = Search(problem, objective=objective, initial=oriented, deadline=time.perf_counter() + 2)
    surrogates.search_by_surrogates(found, method, None, refined=True, windows=False)
    assert aimed == [own]
    assert found.stopped
    # What the stopped search has found is refined all the same.
    assert true_cost(problem, objective, found.oriented) < true_cost(problem, objective, oriented)


@pytest.mark.parametrize(
    ("few", "most", "aimed_at"),
    [(True, 1000, ["time"]), (False, 1000, ["straight"]), (True, 5, ["straight"])],
    ids=["few down-sets", "many down-sets", "many toolpaths"],
)
def test_a_method_that_cannot_see_walls_well_is_led_by_length(monkeypatch, few, most, aimed_at):
    """Its sequence is refined by time all the same."""
    aimed: list[str] = []

    def method(search: Search) -> None:
        aimed.append(search.objective.name)
        search.raise_bound(1e-6 if search.objective.name == "time" else 0.0)

    monkeypatch.setattr(surrogates, "enumerable", lambda _: few)
    monkeypatch.setattr(surrogates, "is_streamable", lambda _: False)
    monkeypatch.setattr(surrogates, "CARRY_UP_TO", {"default": most})
    problem = sheet()
    start = solve(problem, method="greedy")
    oriented = (2 * start.order + start.flipped).astype(np.int32)
    found = Search(problem, objective=GOALS[1], initial=oriented)
    surrogates.search_by_surrogates(found, method, None, refined=True, windows=False, enumerating=True)
    assert aimed == aimed_at
    assert found.cost < true_cost(problem, GOALS[1], oriented)


def test_on_a_sheet_too_large_for_a_proof_beams_see_it_stretched_as_far_as_its_heights_are_dear(monkeypatch):
    seen: list[Problem] = []

    def look(search: Search, *, otherwise) -> None:
        seen.append(search.problem)
        streamed(search, otherwise=otherwise)

    streamed = surrogates._beams
    monkeypatch.setattr(surrogates, "CARRY_UP_TO", {"default": 5, "quick": 5})
    monkeypatch.setattr(surrogates, "_beams", look)
    problem = sheet(1, 3)
    goal = Objective("time", **MACHINE | {"speed_mm_s": (20.0, 20.0, 20.0)})
    proved = solve(problem, method="exact", objective=goal)
    assert proved.proved
    for effort in ("quick", "default"):
        found = solve(problem, objective=goal, effort=effort)
        assert proved.cost <= found.cost * (1 + 1e-9) < 1.05 * proved.cost
        assert 0.9 * found.cost < found.lower_bound <= proved.cost * (1 + 1e-9)
        assert found.lower_bound_mm is None, "a bound on the stretched sheet is none on this one"
    assert len(seen) == 2
    # From stop to stop a short hop takes 2 * sqrt(length / acceleration).
    times = [1.0, np.sqrt(500 / 30)]
    for stretched in seen:
        assert np.allclose(stretched.segments, problem.segments * times, rtol=1e-9)
    routed = solve(problem, objective=Objective("routed", **MACHINE))
    assert np.array_equal(seen[2].segments, problem.segments), "a millimetre is one in every direction"
    assert routed.lower_bound <= routed.cost


def test_where_beams_cannot_look_another_method_searches(monkeypatch):
    monkeypatch.setattr(surrogates, "CARRY_UP_TO", {"default": 5})
    monkeypatch.setattr(surrogates, "streamed_beam", lambda search, *, loose: None)
    asked: list[tuple[str, str]] = []

    def method(search: Search) -> None:
        asked.append((search.objective.name, search.effort))

    found = Search(sheet(1, 3), objective=GOALS[1])
    surrogates.search_by_surrogates(found, method, None, refined=True, windows=False, enumerating=True)
    assert asked == [("straight", "quick")]
    assert found.started


def test_what_bounds_a_stretched_sheet_bounds_nothing_else():
    problem = sheet()
    goal = Search(problem, objective=GOALS[1])
    inner = goal.surrogate("straight", upwards=3.0)
    start = solve(problem, method="greedy")
    inner.offer((2 * start.order + start.flipped).astype(np.int32))
    inner.raise_bound(0.9 * inner.cost)
    assert inner.cost > start.cost
    inner.report("a stage")
    assert goal.cost == true_cost(problem, GOALS[1], inner.oriented)
    goal.absorb(inner.outcome())
    assert goal.straight_bound_mm == goal.lower_bound == 0.0
    plain = goal.surrogate("straight")
    plain.offer(inner.oriented)
    plain.raise_bound(1.0)
    goal.absorb(plain.outcome())
    assert goal.straight_bound_mm == 1.0


def test_ctrl_c_in_the_first_search_ends_them_all(monkeypatch):
    def method(search: Search) -> None:
        search.nodes_visited += 1
        raise KeyboardInterrupt

    def too_late(*_):
        raise AssertionError("Ctrl-C had come before")

    monkeypatch.setattr(surrogates, "refine", too_late)
    problem = sheet()
    start = solve(problem, method="greedy")
    found = Search(problem, objective=GOALS[1], initial=(2 * start.order + start.flipped).astype(np.int32))
    with pytest.raises(KeyboardInterrupt):
        surrogates.search_by_surrogates(found, method, method, refined=True, windows=True)
    assert found.nodes_visited == 1


def test_what_every_search_counts_is_added_up(monkeypatch):
    def method(search: Search) -> None:
        search.nodes_visited += 10
        search.states_created += 100

    problem = sheet()
    start = solve(problem, method="greedy")
    oriented = (2 * start.order + start.flipped).astype(np.int32)
    found = Search(problem, objective=GOALS[0], initial=oriented, effort="quick")
    surrogates.search_by_surrogates(found, method, method, refined=True, windows=False)
    assert (found.nodes_visited, found.states_created) == (30, 300)
    greedy = solve(problem, method="greedy", objective=GOALS[0])
    assert greedy.nodes_visited == start.nodes_visited == problem.n


@pytest.mark.parametrize("objective", GOALS, ids=lambda objective: objective.name)
def test_an_order_without_directions_is_no_dearer_than_as_it_stands(objective):
    for seed in range(30):
        random = np.random.default_rng(seed)
        problem = sheet(seed, 2)
        order = random.permutation(problem.n)
        rank = np.argsort(order)
        while len(broken := [e for e in problem.edges if rank[e[0]] > rank[e[1]]]) or order[0] != 0:
            if order[0] != 0:
                at = int(rank[0])
                order[0], order[at] = order[at], order[0]
            else:
                low, high = broken[0]
                order[rank[low]], order[rank[high]] = high, low
            rank = np.argsort(order)
        for flip in (0, 1):
            plain = true_cost(problem, objective, (2 * order + flip).astype(np.int32))
            result = solve(problem, method="greedy", objective=objective, initial=order)
            assert result.cost <= plain + 1e-9
