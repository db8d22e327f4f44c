"""Prices of travels that jump over a seam column: two blocks together never pay more than it costs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.bound import step_lengths
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.subgradient_ascent import MOMENTUM, begin_ascent
from slicer.sequence.problem import least_travel_cost
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states.blocks import cover
from slicer.sequence.states.downsets import down_sets
from slicer.sequence.states.section import Section

SLOW_Z = Objective("time", 0.0, (20.0, 20.0, 2.0), (500.0, 500.0, 30.0), fixed_s=0.05, fixed_from_mm=0.3)
OBJECTIVES = (
    Objective(),
    SLOW_Z,
    replace(SLOW_Z, join_mm=1.0),
    replace(SLOW_Z, join_mm=1.0, join_downhill_deg=20.0),
)


def bound_of(problem: Problem, objective: Objective, most_states: int = 0) -> PairBound:
    section = Section.whole(problem, objective)
    sets = down_sets(section, 10**6)
    return PairBound.over(section, sets, cover(sets, most_states))


PAPER = Objective("time", 0.2, (100.0, 200.0, 10.0), (500.0, 1000.0, 100.0), 0.087, 1.5)
"""The machine of the profile ``paper``, whose vertical axis is slow."""


def walk(seed: int, objective: Objective, spacing_mm: float = 0.3) -> PairBound:
    segments = hatch(random_walk(5, 4, seed=seed, spacing_mm=spacing_mm)).segments
    return bound_of(Problem.build(segments), objective)


def shares(bound: PairBound, way: int, at: int, column: int) -> np.ndarray:
    """What a block pays for a travel of which it sees one end, without the price at its seam; at each down-set of
    the column that is jumped over."""
    costs, paid = bound.block_costs, bound.paid
    number = costs.price_at[way, at]
    price = costs.price_sign[way, at] * bound.best[number] if number >= 0 else 0.0
    passing = paid.passing[way, bound.sets.start[column] : bound.sets.start[column + 1]]
    if np.isinf(costs.jumps.most[way, at]):
        return np.full(len(passing), paid.ways[way, at] - price)
    return np.clip(paid.ways[way, at] + passing, paid.least[way, at], paid.most[way, at]) - price


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 10**6), most_states=st.sampled_from([0, 300]), objective=st.sampled_from(OBJECTIVES)
)
def test_all_blocks_together_pay_no_more_than_a_jump_costs(sheet, seed, most_states, objective):
    bound = bound_of(Problem.build(sheet(seed, 14, 3)), objective, most_states)
    blocks, section, costs = bound.blocks, bound.section, bound.block_costs
    assume(blocks.blocks > 1)
    bound.best += np.random.default_rng(seed).normal(0.0, 0.3, len(bound.best))
    bound.use_best_multipliers()
    seams, place = blocks.bounds, {}
    for k in range(blocks.blocks):
        for at in range(2 * blocks.path_start[k], 2 * blocks.path_start[k + 1]):
            place[k, 2 * blocks.path[at >> 1] + (at & 1)] = at
    seen = 0
    for u in range(2 * section.n):
        for v in range(2 * section.n):
            a, b = section.column[u >> 1], section.column[v >> 1]
            first, last = min(a, b), max(a, b)
            over = [t for t in range(1, blocks.blocks) if first < seams[t] < last]
            if not over:
                continue
            left, right = over[0] - 1, over[-1]
            nearer, farther = seams[over[0]], seams[over[-1]]
            if a < b:
                leave = shares(bound, LEAVE_RIGHT, place[left, u], nearer)
                enter = shares(bound, ENTER_LEFT, place[right, v], farther)
            else:
                leave = shares(bound, LEAVE_LEFT, place[right, u], farther)
                enter = shares(bound, ENTER_RIGHT, place[left, v], nearer)
            # Over one column both know its down-set; of several, each knows that of another one.
            total = (leave + enter).max() if len(over) == 1 else leave.max() + enter.max()
            total += costs.cross[left + 1 : right].sum()
            d = section.segments[v >> 1, v & 1] - section.segments[u >> 1, 1 - (u & 1)]
            assert total <= least_travel_cost(section.cost_model, d[0], d[1]) + 1e-9
            seen += 1
    assume(seen > 0)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(3))
def test_the_slope_is_that_of_the_bound(seed, objective):
    bound = walk(seed, objective)
    random = np.random.default_rng(seed)
    at_ends = slice(bound.block_costs.visits_end, bound.block_costs.jumps.passing)
    by_sets = slice(at_ends.stop, None)

    def at(multipliers: np.ndarray) -> tuple[float, np.ndarray]:
        """The bound, and the subgradient that a first step of the ascent goes along."""
        bound._ascent = begin_ascent(multipliers)
        bound.improve(1e3, np.zeros(1))
        return float(bound._ascent.bound[0]), bound._ascent.direction / (1.0 - MOMENTUM)

    scale = 0.02 if objective.unit == "s" else 0.05
    here = bound.best + random.normal(0.0, scale, len(bound.best))
    here[at_ends] *= 0.5  # so that jumps are worth their while
    value, slope = at(here)
    assert np.abs(slope[at_ends]).max() > 0
    assert np.abs(slope[by_sets]).max() > 0
    for _ in range(5):
        direction = random.normal(0.0, 1e-7, len(here))
        assert at(here + direction)[0] - value == pytest.approx(float(slope @ direction), abs=1e-11)


def test_they_raise_the_bound_in_seconds():
    bound, without = walk(1, PAPER, 0.2), walk(1, PAPER, 0.2)
    costs = without.block_costs
    costs.jumps.most[:] = np.where(
        np.isinf(costs.jumps.most), np.inf, costs.ways
    )  # as if all jumps went farther
    target = solve(Problem.build(bound.section.segments), objective=PAPER, effort="quick").cost
    for one in (bound, without):
        one.improve(target, step_lengths(40))
    assert bound.bound > 1.01 * without.bound


FOUR_COLUMNS = [
    [[1.8339, 1.8878], [1.5784, 1.1571]],
    [[1.5095, -0.6579], [1.1234, -0.6579]],
    [[0.5495, 0.6034], [0.1099, 0.5120]],
    [[1.5095, -0.0260], [1.5095, 0.3980]],
]
"""A toolpath in each; the best sequences to the one on the right go left once more before it."""


@pytest.mark.parametrize("last", range(8))
def test_a_fixed_end_may_be_come_to_from_either_side(optimum, last):
    slow = Objective("time", 0.0, (1.149, 33.6, 2.0185), (141.8, 13.06, 0.105))
    problem = Problem.build(np.array(FOUR_COLUMNS))
    best = optimum(problem, slow, last=last)
    section = replace(Section.whole(problem, slow), last=last)
    sets = down_sets(section, 10**6)
    bound = PairBound.over(section, sets, cover(sets, 0))
    for _ in range(20):
        bound.improve(1.2 * best, step_lengths(30))
        assert bound.bound <= best + 1e-9
