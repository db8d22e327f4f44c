"""The ascent along subgradients: its slope, that it only rises, and what it looks at while it does."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies
from counted import relaxed_sets
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from slicer.errors import CycleError
from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.nozzle import POINT
from slicer.sequence import Problem, solve
from slicer.sequence.bound import nearby, pair_bound, step_lengths
from slicer.sequence.bound.nearby import Nearby, near_states
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.subgradient_ascent import (
    FIRST_LENGTH,
    LAST_LENGTH,
    MOMENTUM,
    begin_ascent,
)
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states import NONE
from slicer.sequence.states.blocks import cover
from slicer.sequence.states.downsets import down_sets
from slicer.sequence.states.section import Section

TIME = Objective("time", 0.2, (20.0, 20.0, 2.0), (500.0, 500.0, 30.0), fixed_s=0.05, fixed_from_mm=0.3)
OBJECTIVES = (Objective(), TIME, replace(TIME, join_mm=1.0), Objective("routed", 0.3))


def bound_of(section: Section, *, counted: bool = False) -> PairBound:
    """The bound over pairs of columns, or over counts, with all walls seen."""
    sets = relaxed_sets(section, 1) if counted else down_sets(section, 10**6)
    bound = PairBound.over(section, sets, cover(sets))
    bound.see_walls(np.inf)
    return bound


def section_of(segments: np.ndarray, objective: Objective, seed: int, body=POINT, downhill: float = 90.0):
    """With the start, and in some the end, fixed or not."""
    random = np.random.default_rng(seed)
    try:
        problem = Problem.build(segments, body=body, downhill_deg=downhill)
    except CycleError:
        reject()
    if random.random() < 0.5:
        first = int(random.choice(problem.starts) >> 1)
        problem = Problem.build(segments, body=body, downhill_deg=downhill, first=first)
    section = Section.whole(problem, objective)
    if random.random() < 0.3:
        some = solve(problem, method="greedy")
        section = replace(section, last=2 * int(some.order[-1]) + int(some.flipped[-1]))
    return section


def test_lengths_shrink_by_the_same_factor():
    lengths = step_lengths(40)
    assert (lengths[0], lengths[-1]) == pytest.approx((FIRST_LENGTH, LAST_LENGTH))
    assert np.diff(np.log(lengths)) == pytest.approx(np.log(LAST_LENGTH / FIRST_LENGTH) / 39)
    again = step_lengths(40, 0.01)
    assert LAST_LENGTH < again[0] < FIRST_LENGTH
    assert again[-1] == pytest.approx(LAST_LENGTH)
    assert step_lengths(3, 0.0) == pytest.approx([LAST_LENGTH] * 3)


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    objective=st.sampled_from(OBJECTIVES),
    body=st.just(POINT) | bodies(),
    downhill=st.sampled_from([90.0, 30.0]),
    counted=st.booleans(),
)
def test_the_slope_is_that_of_the_bound(sheet, seed, objective, body, downhill, counted):
    section = section_of(sheet(seed, 14, 3), objective, seed, body, downhill)
    assume(not counted or section.last == NONE)
    bound = bound_of(section, counted=counted)
    random = np.random.default_rng(seed)

    def at(multipliers: np.ndarray) -> tuple[float, np.ndarray]:
        bound._ascent = begin_ascent(multipliers)
        bound.improve(1.0, np.zeros(1))
        return float(bound._ascent.bound[0]), bound._ascent.direction / (1.0 - MOMENTUM)

    here = bound.best + random.normal(0.0, 0.05, len(bound.best))
    value, slope = at(here)
    assume(np.isfinite(value))
    for _ in range(3):
        way = random.normal(0.0, 1e-8, len(here))
        assert at(here + way)[0] - value == pytest.approx(float(slope @ way), abs=1e-11)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6), objective=st.sampled_from(OBJECTIVES), downhill=st.sampled_from([90.0, 30.0])
)
def test_it_only_rises_and_stays_below_what_is_found(sheet, seed, objective, downhill):
    section = section_of(sheet(seed, 14, 3), objective, seed, downhill=downhill)
    assume(section.last == NONE)
    bound = bound_of(section)
    first = None if section.first == NONE else section.first
    problem = Problem.build(section.segments, downhill_deg=downhill, first=first)
    cost = solve(problem, objective=objective).cost
    last = -np.inf
    for _ in range(4):
        bound.improve(cost, step_lengths(7))
        assert last <= bound.bound <= cost + 1e-9
        last = bound.bound
        bound.use_best_multipliers()
        assert bound.bound == last
        bound.fix_states(cost + 1e-9)  # what only equals the cost may be left out


def test_it_comes_to_the_same_in_parts():
    section = Section.whole(Problem.build(hatch(random_walk(5, 4, seed=3)).segments), TIME)
    whole, parts = bound_of(section), bound_of(section)
    begun, lengths = whole.best.copy(), step_lengths(60)
    whole.improve(20.0, lengths)
    for at in range(0, 60, 10):
        parts.improve(20.0, lengths[at : at + 10])
    assert parts.bound == whole.bound
    assert (whole.best != begun).any()
    value = whole.bound
    whole.use_best_multipliers()
    assert whole.bound == value


@pytest.mark.parametrize("objective", [Objective(), TIME], ids=["straight", "time"])
@pytest.mark.parametrize("heaps", [2, 4])
def test_it_is_not_misled_by_travels_that_have_to_be_long(heaps, objective):
    heap = hatch(random_walk(3, 3, seed=2, spacing_mm=0.3)).segments
    segments = np.concatenate([heap + [30.0 * k, 0.0] for k in range(heaps)])
    bound = bound_of(Section.whole(Problem.build(segments), objective))
    cost = solve(Problem.build(segments), objective=objective).cost
    bound.use_best_multipliers()
    begun = bound.bound
    bound.improve(cost, step_lengths(100))
    assert cost - bound.bound < 0.5 * (cost - begun)


@settings(max_examples=80, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    objective=st.sampled_from(OBJECTIVES),
    body=st.just(POINT) | bodies(),
    pace=st.sampled_from([0.5, 1.0, 2.0, 4.0]),
    counted=st.booleans(),
)
def test_among_near_states_it_bounds_all(sheet, seed, objective, body, pace, counted):
    section = section_of(sheet(seed, 20, 3), objective, seed, body)
    assume(section.last == NONE)
    sets = relaxed_sets(section, 1) if counted else down_sets(section, 10**6)
    bound = PairBound.over(section, sets, cover(sets))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pair_bound, "PACE", pace)  # so that walls are seen there alone
        bound.see_walls(np.inf)
    bound.pace = pace
    first = None if section.first == NONE else section.first
    cost = solve(Problem.build(section.segments, body=body, first=first), objective=objective).cost
    for _ in range(4):
        bound.improve(cost, step_lengths(10))
        assert bound.bound <= cost + 1e-9
        assert bound._evaluate(bound.best).min() == bound.bound


def test_it_looks_at_near_states_alone_and_at_all_where_those_mislead():
    problem = Problem.build(hatch(random_walk(6, 6, seed=1)).segments)
    section = Section.whole(problem, TIME)
    sets = down_sets(section, 10**6)
    cost = solve(problem, objective=TIME).cost
    whole, near, narrow = (PairBound.over(section, sets, cover(sets)) for _ in range(3))
    near.pace, narrow.pace = 28.0, 4.0
    chosen = near_states(section, sets, near.blocks, 28.0)
    assert len(near.looked_at.near.blocks.dense) <= chosen.sum() < 0.7 * len(near.blocks.dense)
    lengths = step_lengths(40)
    for bound in (whole, near, narrow):
        for at in range(0, 40, 10):
            bound.improve(cost, lengths[at : at + 10])
    assert near.pace == 28.0
    assert near.bound == pytest.approx(whole.bound, rel=1e-3)
    assert np.min(narrow.pace) >= 4.0 < np.max(narrow.pace)
    assert narrow.bound > 0.95 * whole.bound


@pytest.fixture
def chosen(monkeypatch):
    """Let ascents on small sheets choose as on large ones, and note how many states they choose of how many."""
    monkeypatch.setattr(nearby, "MANY", 0)
    monkeypatch.setattr(nearby, "LEAST_STEPS", 1)
    counts: list[tuple[int, int]] = []
    choose = Nearby._choose

    def noted(self, *at):
        out = choose(self, *at)
        counts.append((len(out.blocks.dense), len(self.near.blocks.dense)))
        return out

    monkeypatch.setattr(Nearby, "_choose", noted)
    return counts


def climbed(section, sets, cost, steps=60) -> PairBound:
    bound = PairBound.over(section, sets, cover(sets))
    lengths = step_lengths(steps)
    for at in range(0, steps, 20):
        bound.improve(cost, lengths[at : at + 20])
    return bound


@pytest.mark.parametrize("objective", [TIME, Objective()])
def test_where_walks_are_cheap_it_rises_as_it_would_among_all(chosen, monkeypatch, objective):
    problem = Problem.build(hatch(random_walk(6, 6, seed=1)).segments)
    section = Section.whole(problem, objective)
    sets = down_sets(section, 10**6)
    cost = solve(problem, objective=objective).cost
    chosen.clear()
    few = climbed(section, sets, cost)
    assert chosen
    assert all(some < 0.5 * states for some, states in chosen)
    monkeypatch.setattr(nearby, "MANY", np.inf)
    assert few.bound == pytest.approx(climbed(section, sets, cost).bound, rel=1e-3)


def test_it_looks_farther_where_the_chosen_states_mislead(chosen, monkeypatch):
    monkeypatch.setattr(nearby, "STRIDE", np.inf)
    monkeypatch.setattr(nearby, "LEAST_SHARE", 0.0)
    problem = Problem.build(hatch(random_walk(4, 4, seed=1)).segments)
    section = Section.whole(problem, TIME)
    sets = down_sets(section, 10**6)
    bound = PairBound.over(section, sets, cover(sets))
    bound.looked_at.reach = 0.01
    cost = solve(problem, objective=TIME).cost
    bound.improve(cost, step_lengths(40))
    assert bound.looked_at.reach > 0.01
    assert bound.bound <= cost + 1e-9
    assert bound._evaluate(bound.best).min() == bound.bound


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), objective=st.sampled_from(OBJECTIVES), body=st.just(POINT) | bodies())
def test_among_chosen_states_it_bounds_all(sheet, seed, objective, body):
    section = section_of(sheet(seed, 20, 3), objective, seed, body)
    assume(section.last == NONE)
    sets = down_sets(section, 10**6)
    first = None if section.first == NONE else section.first
    cost = solve(Problem.build(section.segments, body=body, first=first), objective=objective).cost
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nearby, "MANY", 0)
        patch.setattr(nearby, "LEAST_STEPS", 1)
        bound = PairBound.over(section, sets, cover(sets))
        bound.see_walls(np.inf)
        last = bound._evaluate(bound.best).min()
        for _ in range(3):
            bound.improve(cost, step_lengths(10))
            assert last - 1e-9 <= bound.bound <= cost + 1e-9
            assert bound._evaluate(bound.best).min() == bound.bound
            last = bound.bound
