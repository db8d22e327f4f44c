"""All walks weighed: the sum that a plain programme in logarithms gives, its slope, and an ascent that is none
the worse for long travels."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from slicer.errors import CycleError
from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.nozzle import POINT
from slicer.sequence import Problem, solve
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.quasi_newton import QuasiNewton
from slicer.sequence.bound.smoothed_bound import SmoothedBound
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states import NONE, OUTSIDE
from slicer.sequence.states.blocks import cover
from slicer.sequence.states.downsets import down_sets
from slicer.sequence.states.relaxed_columns import relaxed_sets
from slicer.sequence.states.section import Section

TIME = Objective("time", 0.2, (20.0, 20.0, 2.0), (500.0, 500.0, 30.0), fixed_s=0.05, fixed_from_mm=0.3)
OBJECTIVES = (Objective(), TIME, replace(TIME, join_mm=1.0), Objective("routed", 0.3))


def bound_of(section: Section, *, counted: bool = False) -> PairBound:
    """The bound over pairs of columns, or over counts, with all walls seen."""
    sets = relaxed_sets(section, 1)[0] if counted else down_sets(section, 10**6)
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


def smoothed_of(bound: PairBound, temperature: float) -> SmoothedBound:
    smoothed = SmoothedBound(bound.blocks, bound.block_costs, bound.ends, bound.paid, bound.value)
    smoothed.cool(temperature)
    return smoothed


def in_logarithms(bound: PairBound, multipliers: np.ndarray, temperature: float) -> float:
    """The same sum without anything clever: what ``pair_dp`` does with the least replaced, value by value."""
    bound._evaluate(multipliers)  # what blocks pay
    blocks, costs, ends, paid = bound.blocks, bound.block_costs, bound.ends, bound.paid

    def pay(way: int, at: int, s: int) -> float:
        if not costs.jumps.priced[way, at]:
            return paid.ways[way, at]
        leftward = way in (LEAVE_LEFT, ENTER_LEFT)
        jump = paid.ways[way, at] + paid.passing[way, blocks.end_set[s, 0 if leftward else 1]]
        return max(paid.least[way, at], min(jump, paid.most[way, at]))

    def soft(values: list[float]) -> float:
        least = min(values, default=np.inf)
        if not np.isfinite(least):
            return least
        return least - temperature * np.log(sum(np.exp((least - v) / temperature) for v in values))

    value = np.full(blocks.value_start[-1], np.inf)
    for k in range(blocks.blocks):
        low, stride = 2 * blocks.path_start[k], 2 * (blocks.path_start[k + 1] - blocks.path_start[k])
        final = blocks.state_start[k + 1] - 1
        for s in range(final, blocks.state_start[k] - 1, -1):
            at, first, end = blocks.value_start[s], blocks.move_start[s], blocks.move_start[s + 1]
            steps = [(m, f) for m in range(first, end) for f in range(2)]
            rest = {(m, f): value[blocks.move_value[m] + f] for m, f in steps}
            if s == final:
                outside = [0.0, 0.0]
                own, stays = NONE, 0.0
                if ends.last_home[0] != NONE:
                    left, right = ends.last_home[1] < k, ends.last_home[0] > k
                    outside[0] = 0.0 if left else costs.cross[k] if right else np.inf
                    outside[1] = 0.0 if right else costs.cross[k] if left else np.inf
                    stays = np.inf
                    if not left and not right:
                        own = ends.last_local[0] if ends.last_home[0] == k else ends.last_local[1]
            else:
                entries = [
                    soft([pay(way, low + 2 * blocks.move_path[m] + f, s) + rest[m, f] for m, f in steps])
                    for way in (ENTER_LEFT, ENTER_RIGHT)
                ]
                outside = [
                    soft([entries[0], entries[1] + costs.cross[k]]),
                    soft([entries[1], entries[0] + costs.cross[k]]),
                ]
            value[at : at + 2] = outside
            for x in range(at + OUTSIDE, blocks.value_start[s + 1]):
                u = blocks.value_path[x]
                if not blocks.allowed[low + u]:
                    continue
                sums = [outside[0] + pay(LEAVE_LEFT, low + u, s), outside[1] + pay(LEAVE_RIGHT, low + u, s)]
                if s == final:
                    sums.append(0.0 if u == own else stays)
                for m, f in steps:
                    v = 2 * blocks.move_path[m] + f
                    cost = paid.arc[costs.arc_start[k] + u * stride + v]
                    if len(costs.detour):
                        row = costs.detour_start[s] + 2 * (end - first) * (x - at - OUTSIDE)
                        cost += costs.detour[row + 2 * (m - first) + f]
                    sums.append(cost + rest[m, f])
                value[x] = soft(sums)
    bound.value[:] = value
    return soft(list(bound._by_start(multipliers)))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    objective=st.sampled_from(OBJECTIVES),
    body=st.just(POINT) | bodies(),
    downhill=st.sampled_from([90.0, 30.0]),
    warm=st.sampled_from([3.0, 0.3, 0.03, 0.01]),  # at the last ones some weights are no numbers
    noise=st.sampled_from([0.05, 0.05, 1.0, 20.0]),  # and so with the last prices
)
def test_it_is_the_sum_over_all_walks(sheet, seed, objective, body, downhill, warm, noise):
    section = section_of(sheet(seed, 9, 2), objective, seed, body, downhill)
    bound = bound_of(section)
    multipliers = bound.best + np.random.default_rng(seed).normal(0.0, noise, len(bound.best))
    hard = bound._evaluate(multipliers)
    assume(np.isfinite(hard))
    temperature = warm * (0.3 if objective.unit == "s" else 1.0)
    found = smoothed_of(bound, temperature).at(multipliers)
    assert found.bound == pytest.approx(in_logarithms(bound, multipliers, temperature), abs=1e-5)
    assert found.bound <= hard + 1e-5


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    objective=st.sampled_from(OBJECTIVES),
    downhill=st.sampled_from([90.0, 30.0]),
    counted=st.booleans(),
)
def test_its_slope_is_the_share_of_walks(sheet, seed, objective, downhill, counted):
    section = section_of(sheet(seed, 14, 3), objective, seed, downhill=downhill)
    assume(not counted or section.last == NONE)
    bound = bound_of(section, counted=counted)
    random = np.random.default_rng(seed)
    multipliers = bound.best + random.normal(0.0, 0.05, len(bound.best))
    assume(np.isfinite(bound._evaluate(multipliers)))
    smoothed = smoothed_of(bound, 0.1)
    found = smoothed.at(multipliers)
    gradient = found.gradient.copy()  # the next look writes over it
    assert (found.use >= np.abs(found.gradient) - (1.0 if counted else 1e-9)).all()
    for _ in range(3):
        way = random.normal(0.0, 1e-6, len(multipliers))
        growth = smoothed.at(multipliers + way).bound - smoothed.at(multipliers - way).bound
        assert growth == pytest.approx(2 * float(gradient @ way), abs=1e-8)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6), objective=st.sampled_from(OBJECTIVES), downhill=st.sampled_from([90.0, 30.0])
)
def test_the_ascent_only_rises_and_stays_below_what_is_found(sheet, seed, objective, downhill):
    section = section_of(sheet(seed, 14, 3), objective, seed, downhill=downhill)
    assume(section.last == NONE)
    bound = bound_of(section)
    first = None if section.first == NONE else section.first
    problem = Problem.build(section.segments, downhill_deg=downhill, first=first)
    cost = solve(problem, objective=objective).cost
    last = -np.inf
    for _ in range(4):
        bound.improve(1e3, 7)
        assert last <= bound.bound <= cost + 1e-9
        last = bound.bound
        bound.use_best_multipliers()
        assert bound.bound == last
        bound.fix_states(cost + 1e-9)  # what only equals the cost may be left out


def test_the_colder_the_nearer():
    problem = Problem.build(hatch(random_walk(4, 4, seed=1)).segments)
    bound = bound_of(Section.whole(problem, TIME))
    hard = bound._evaluate(bound.best)
    values = [smoothed_of(bound, temperature).at(bound.best).bound for temperature in (0.1, 0.01, 0.001)]
    assert values == sorted(values)
    assert values[-1] <= hard
    assert hard - values[-1] < 0.1 * (hard - values[0])


@pytest.mark.parametrize("objective", [Objective(), TIME], ids=["straight", "time"])
@pytest.mark.parametrize("heaps", [2, 4])
def test_it_is_not_misled_by_travels_that_have_to_be_long(heaps, objective):
    # Heaps far apart: when it is cold, the weight of a travel between them is nothing, and prices are high.
    heap = hatch(random_walk(3, 3, seed=2, spacing_mm=0.3)).segments
    segments = np.concatenate([heap + [30.0 * k, 0.0] for k in range(heaps)])
    bound = bound_of(Section.whole(Problem.build(segments), objective))
    cost = solve(Problem.build(segments), objective=objective).cost
    begun = bound._evaluate(bound.best)
    bound.improve(cost, 100)
    assert cost - bound.bound < 0.5 * (cost - begun)
    ascent = bound._ascent
    found = smoothed_of(bound, ascent._temperature).at(ascent.multipliers)
    assert np.isfinite(found.gradient).all()
    assert found.bound == pytest.approx(
        in_logarithms(bound, ascent.multipliers, ascent._temperature), rel=1e-6
    )
    assert found.bound <= bound._evaluate(ascent.multipliers) + 1e-9


def test_quasi_newton_climbs_a_hill_whose_slopes_differ():
    random = np.random.default_rng(0)
    steep = np.exp(random.uniform(-3.0, 3.0, 40))
    top = random.normal(0.0, 1.0, 40)
    curvature, here = QuasiNewton(), np.zeros(60)
    used = np.zeros(60, np.bool_)
    for step in range(60):
        used[: min(40, 10 * (step + 1))] = True  # coordinates come into use
        curvature.hold(used)
        held = curvature.active
        slope = steep[held] * (top[held] - here[held])
        if np.abs(slope).max() < 1e-9:
            break
        way = curvature.direction(slope, np.full(len(held), 0.05))
        assert way @ slope > 0.0
        length = (way @ slope) / (way @ (steep[held] * way))  # the best along this way
        here[held] += length * way
        curvature.learn(length * way, length * steep[held] * way)
    assert here[:40] == pytest.approx(top, abs=0.01)
    assert (here[40:] == 0.0).all()


def test_an_ascent_is_carried_on_where_it_was():
    section = Section.whole(Problem.build(hatch(random_walk(5, 4, seed=3)).segments), TIME)
    whole, parts = bound_of(section), bound_of(section)
    begun = whole.best.copy()
    whole.improve(1e3, 60)
    for _ in range(6):
        parts.improve(1e3, 10)
    assert parts.bound == pytest.approx(whole.bound, rel=0.01)
    assert (whole.best != begun).any()
    value = whole.bound
    whole.use_best_multipliers()
    assert whole.bound == value


def test_it_stops_between_two_looks(monkeypatch):
    bound = bound_of(Section.whole(Problem.build(hatch(random_walk(5, 4, seed=3)).segments), TIME))
    looks, at = [], SmoothedBound.at

    def look(smoothed, multipliers):
        looks.append(multipliers)
        return at(smoothed, multipliers)

    monkeypatch.setattr(SmoothedBound, "at", look)
    assert not bound.improve(1e3, 50, lambda: len(looks) >= 7)
    assert len(looks) == 7
    # It goes on where it was.
    assert not bound.improve(1e3, 3)
    assert 10 <= len(looks) <= 15
