"""The column-pair bound: below every sequence, whatever its multipliers are."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies
from exhaustive import least_cost
from hypothesis import assume, example, given, reject, settings
from hypothesis import strategies as st

from slicer.errors import CycleError
from slicer.grid import Grid
from slicer.hatch import hatch
from slicer.nozzle import POINT, NozzleBody
from slicer.sequence import Problem, solve
from slicer.sequence.bound import step_lengths
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states import OUTSIDE, sets_of_states
from slicer.sequence.states.blocks import cover
from slicer.sequence.states.downsets import down_sets
from slicer.sequence.states.section import Section

ROUTED = Objective("routed", 0.3)
SLOW_Z = Objective("time", 0.0, (20.0, 20.0, 2.0), (500.0, 500.0, 30.0), fixed_s=0.05, fixed_from_mm=0.3)


def bound_over(section: Section, most_states: int = 0) -> PairBound:
    """The bound over pairs of columns, or over more where those have few states."""
    sets = down_sets(section, 10**6)
    return PairBound.over(section, sets, cover(sets, most_states))


def start_anyhow(segments: np.ndarray, seed: int) -> Problem:
    """The start free or fixed, and its direction as well."""
    random = np.random.default_rng(seed)
    problem = Problem.build(segments)
    flipped = [None, False, True][random.integers(3)]
    first = int(random.choice(problem.starts) >> 1) if random.random() < 0.5 else None
    return Problem.build(segments, first=first, first_flipped=flipped)


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    width=st.integers(2, 4),
    objective=st.sampled_from([Objective(), SLOW_Z]),
    noise=st.booleans(),
)
def test_no_multipliers_make_the_bound_exceed_the_optimum(sheet, optimum, seed, width, objective, noise):
    problem = start_anyhow(sheet(seed, 8, 2), seed)
    section = Section.whole(problem, objective)
    bound = bound_over(section, 30**width)
    best = optimum(problem, objective)
    if noise:
        bound.best += np.random.default_rng(seed).normal(0.0, 0.5, len(bound.best))
    else:
        bound.improve(1.1 * best, step_lengths(60))
        assert bound.bound <= best + 1e-9
    bound.use_best_multipliers()
    assert bound.bound <= best + 1e-9


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    width=st.integers(2, 4),
    objective=st.sampled_from([ROUTED, replace(SLOW_Z, clearance_mm=0.2), replace(SLOW_Z, join_mm=1.0)]),
    body=st.one_of(st.just(POINT), bodies()),
    most=st.sampled_from([np.inf, 0.5]),
)
# A hop that is laid slowly costs less where it has to rise, and the search had left it out as too dear.
@example(
    seed=545,
    width=2,
    objective=replace(SLOW_Z, join_mm=1.0),
    body=NozzleBody(0.025, 0.0, np.inf, 0.0, 0.0, np.inf, np.inf),
    most=np.inf,
)
def test_with_walls_it_does_not_exceed_the_optimum(sheet, seed, width, objective, body, most):
    segments = sheet(seed, 8, 2)
    try:
        problem = Problem.build(segments, body=body)
    except CycleError:
        reject()
    section = Section.whole(problem, objective)
    bound = bound_over(section, 30**width)
    # The brute force knows no routes of a body; what any sequence costs is above a bound as well.
    point = body is POINT
    best = least_cost(objective, segments) if point else solve(problem, objective=objective).cost
    bound.see_walls(most)
    for _ in range(2):
        bound.improve(1.1 * best, step_lengths(40))
        assert bound.bound <= best + 1e-9
        bound.use_best_multipliers()
        assert bound.bound <= best + 1e-9
        bound.fix_states(best + 1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), objective=st.sampled_from([ROUTED, replace(SLOW_Z, clearance_mm=0.2)]))
def test_one_block_over_all_columns_that_sees_walls_gives_the_optimum(sheet, seed, objective):
    problem = Problem.build(sheet(seed, 8, 2))
    bound = bound_over(Section.whole(problem, objective), 10**9)
    bound.see_walls(np.inf)
    bound.use_best_multipliers()
    assert bound.bound == pytest.approx(least_cost(objective, problem.segments), rel=3e-6)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_walls_stay_when_states_are_struck_out(sheet, seed):
    problem = start_anyhow(sheet(seed, 14, 3), seed)
    bound = bound_over(Section.whole(problem, ROUTED))
    bound.see_walls(np.inf)
    before = bound.blocks.arcs
    bound.improve(1e3, step_lengths(40))
    bound.use_best_multipliers()
    bound.fix_states(bound.bound * 1.05)
    assume(bound.blocks.arcs < before)
    kept = bound.block_costs
    bound.see_walls(np.inf)
    assert (kept.detour == bound.block_costs.detour).all()
    assert (kept.detour_start == bound.block_costs.detour_start).all()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_one_block_over_all_columns_gives_the_optimum(sheet, optimum, seed):
    problem = start_anyhow(sheet(seed, 8, 2), seed)
    section = Section.whole(problem, Objective())
    bound = bound_over(section, 10**9)
    bound.use_best_multipliers()
    assert bound.bound == pytest.approx(optimum(problem), abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_section_ends_where_it_must(sheet, optimum, seed):
    problem = Problem.build(sheet(seed, 8, 3))
    last = 2 * problem.n - 2 + seed % 2
    part = Problem.build(problem.segments, first=0, first_flipped=seed % 3 == 0)
    section = replace(Section.whole(part, Objective()), last=last)
    for most_states in (0, 10**9):
        bound = bound_over(section, most_states)
        best = optimum(part, last=last)
        bound.improve(best, step_lengths(40))
        bound.use_best_multipliers()
        assert bound.bound <= best + 1e-9
        if most_states:
            assert bound.bound == pytest.approx(best, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_striking_out_states_spares_the_optimum(sheet, optimum, seed):
    problem = start_anyhow(sheet(seed, 8, 2), seed)
    section = Section.whole(problem, Objective())
    best = optimum(problem)
    bound = bound_over(section)
    for _ in range(3):
        if bound.improve(best, step_lengths(10)):
            break
        bound.use_best_multipliers()
        bound.fix_states(best + 1e-9)
    bound.use_best_multipliers()
    assert bound.bound <= best + 1e-9


def test_the_bound_of_two_tiles_side_by_side_is_the_optimum():
    y = np.arange(4) * 0.5
    left = np.stack([np.stack([0 * y, y], 1), np.stack([0 * y + 1, y], 1)], 1)
    segments = np.concatenate([left, left + np.array([1.0, 0.0])])
    problem = Problem.build(segments, first=0, first_flipped=False)
    section = Section.whole(problem, Objective())
    bound = bound_over(section)
    bound.use_best_multipliers()
    # Every line of both tiles in turn, to and fro: a step up after each pair of lines.
    assert bound.bound == pytest.approx(1.5)


def detours_within(bound: PairBound, column: int) -> list[dict[tuple[int, int, int], float]]:
    """For each block that has a column, the detours inside it: by its down-set and both oriented toolpaths."""
    blocks, costs, of = bound.blocks, bound.block_costs, bound.section.column
    first, sets = sets_of_states(blocks, bound.sets)
    out = []
    for k in np.unique(blocks.home[column]):
        found: dict[tuple[int, int, int], float] = {}
        low, width = blocks.path_start[k], blocks.bounds[k + 1] - blocks.bounds[k] + 1
        for s in range(blocks.state_start[k], blocks.state_start[k + 1]):
            row = first[k] + (s - blocks.state_start[k]) * width
            at = costs.detour_start[s + 1]
            for u in blocks.value_path[blocks.value_start[s] + OUTSIDE : blocks.value_start[s + 1]]:
                for path in blocks.move_path[blocks.move_start[s] : blocks.move_start[s + 1]]:
                    ends = blocks.path[low + (u >> 1)], blocks.path[low + path]
                    for f in range(2):
                        if of[ends[0]] == of[ends[1]] == column:
                            key = int(sets[row + column - blocks.bounds[k]]), int(u & 1) + 2 * int(ends[0])
                            found[(*key, 2 * int(ends[1]) + f)] = float(costs.detour[at])
                        at += 1
        out.append(found)
    return out


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_blocks_that_share_a_column_share_its_detours(seed):
    angles = np.random.default_rng(seed).uniform(-80.0, 80.0, (2, 3))
    problem = Problem.build(hatch(Grid(angles, np.full(angles.shape, 0.3), (1.0, 1.0))).segments)
    section = Section.whole(problem, ROUTED)
    whole, pairs = bound_over(section, 10**9), bound_over(section)
    assert whole.blocks.blocks == 1
    for bound in (whole, pairs):
        bound.see_walls(np.inf)
    shared = 0.0
    for column in range(section.columns):
        (all_of_it,) = detours_within(whole, column)
        parts = detours_within(pairs, column)
        for part in parts:
            assert part.keys() == all_of_it.keys()
        for key, extra in all_of_it.items():
            assert sum(part[key] for part in parts) == pytest.approx(extra, abs=1e-6)
        shared += sum(all_of_it.values()) if len(parts) == 2 else 0.0
    assume(shared > 0.0)
