"""Bounds over counts, and by a spanning tree: below every sequence, whatever their multipliers are."""

import json
from dataclasses import replace

import numpy as np
import pytest
from counted import relaxed_sets
from exhaustive import least_cost
from fields import random_body, segment_sets
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer import generate, grid
from slicer.cutting import cut
from slicer.errors import CycleError
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem, solve
from slicer.sequence.bound import raise_relaxed_bound, relaxed_bound, step_lengths, tree_bound
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.subgradient_ascent import MOMENTUM, begin_ascent
from slicer.sequence.bound.tree_bound import STEPS, TreeBound, raise_tree_bound
from slicer.sequence.construct import start_greedily
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search
from slicer.sequence.states import COUNTED, RelaxedColumns, cover, relaxed_columns
from slicer.sequence.states.section import Section

MACHINE = {"clearance_mm": 0.1, "speed_mm_s": (20.0, 20.0, 2.0), "acceleration_mm_s2": (500.0, 500.0, 30.0)}
GOALS = {
    "straight": Objective(),
    "routed": Objective("routed", **MACHINE),
    "time": Objective("time", **MACHINE, fixed_s=0.05, fixed_from_mm=0.3),
    "joined": Objective("time", **MACHINE, fixed_s=0.05, join_mm=0.6, join_speed_mm_s=1.0),
    "uphill": Objective(
        "time", **MACHINE, fixed_s=0.05, join_mm=1.0, join_speed_mm_s=20.0, join_downhill_deg=0.0
    ),
}
BODY = NozzleBody.of(0.25, press_mm=0.02)
seeds = st.integers(0, 10**6)


def started(segments: np.ndarray, seed: int, **rest: object) -> Problem:
    """The start free or fixed, and its direction as well."""
    random = np.random.default_rng(seed)
    problem = Problem.build(segments, **rest)
    flipped = [None, False, True][random.integers(3)]
    first = int(random.choice(problem.starts) >> 1) if random.random() < 0.5 else None
    if not problem.allowed.all():
        flipped = None
    return Problem.build(segments, first=first, first_flipped=flipped, **rest)


def counted(problem: Problem, goal: Objective, most_arcs: int = 0) -> PairBound:
    """The bound over counts, the coarser the fewer travels it may look at."""
    section = Section.whole(problem, goal)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(relaxed_columns, "MOST_DOWN_SETS", 0)
        sets = relaxed_sets(section, most_arcs)
    assert (sets.corridor == COUNTED).all()
    return PairBound.over(section, sets, cover(sets))


def never_above(bound: PairBound | TreeBound, best: float, seed: int) -> None:
    """Raise it, then try other multipliers; the bound is that at the best ones."""
    if isinstance(bound, TreeBound):
        for _ in range(40):
            bound.improve(1.1 * best)
        assert bound.bound <= best + 1e-9
        bound.multiplier = bound.multiplier + np.random.default_rng(seed).normal(
            0.0, 0.5, len(bound.multiplier)
        )
        assert bound.evaluate()[0] <= best + 1e-9
    else:
        bound.improve(1.1 * best, step_lengths(40))
        assert bound.bound <= best + 1e-9
        bound.best += np.random.default_rng(seed).normal(0.0, 0.5, len(bound.best))
        bound.use_best_multipliers()
        assert bound.bound <= best + 1e-9


@settings(max_examples=80, deadline=None)
@given(seeds, st.sampled_from(sorted(GOALS)), st.sampled_from([0, 200, 10**6]))
def test_no_multipliers_make_the_bound_over_counts_exceed_the_optimum(sheet, optimum, seed, name, most_arcs):
    problem = started(sheet(seed, 8, 2), seed)
    never_above(counted(problem, GOALS[name], most_arcs), optimum(problem, GOALS[name]), seed)


@settings(max_examples=80, deadline=None)
@given(segment_sets(max_n=7), seeds, st.sampled_from(sorted(GOALS)))
def test_nor_among_any_segments(segments, seed, name):
    assume(len(segments) > 1)
    problem = started(segments, seed)
    best = least_cost(GOALS[name], segments, problem.first, problem.first_flipped)
    never_above(counted(problem, GOALS[name]), best, seed)
    never_above(TreeBound(problem, GOALS[name].cost_model), best, seed)


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(sorted(GOALS)))
def test_no_multipliers_make_a_tree_exceed_the_optimum(sheet, optimum, seed, name):
    problem = started(sheet(seed, 8, 2), seed)
    with pytest.MonkeyPatch.context() as patch:
        # Most travels of a small sheet are listed otherwise.
        patch.setattr("slicer.sequence.bound.tree_bound.REACH", np.random.default_rng(seed).uniform(0.3, 3.0))
        tree = TreeBound(problem, GOALS[name].cost_model)
    never_above(tree, optimum(problem, GOALS[name]), seed)


@settings(max_examples=20, deadline=None)
@given(seeds, st.sampled_from(["straight", "time"]), st.sampled_from([90.0, 20.0]))
def test_a_body_and_directions_only_make_sequences_dearer(sheet, seed, name, downhill):
    random = np.random.default_rng(seed)
    try:
        problem = started(sheet(seed, 6, 2), seed, body=random_body(random, 0.2), downhill_deg=downhill)
    except CycleError:
        assume(False)
    searched = solve(problem, method="exact", objective=GOALS[name])
    assume(searched.proved)
    never_above(counted(problem, GOALS[name]), searched.cost, seed)
    never_above(TreeBound(problem, GOALS[name].cost_model), searched.cost, seed)


def steep(cols: int, rows: int, seed: int, spacing: float = 0.12) -> Problem:
    """A sheet of steep tiles, in whose columns lines stand side by side."""
    angles = np.random.default_rng(seed).uniform(65.0, 90.0, (rows, cols)) * [[1, -1] * cols][0][:cols]
    described = {"tile_mm": 1.0, "spacing_mm": spacing, "angles_deg": angles.tolist()}
    return Problem.build(hatch(grid.loads(json.dumps(described))).segments)


def raised(problem: Problem, goal: Objective, effort: str = "quick") -> Search:
    search = Search(problem, objective=goal, effort=effort)
    start_greedily(search)
    raise_relaxed_bound(search)
    return search


@pytest.mark.parametrize("name", ["straight", "time"])
@pytest.mark.parametrize(("cols", "rows"), [(1, 4), (3, 4)])
def test_steep_columns_have_a_bound_that_a_tree_does_not_reach(cols, rows, name):
    problem = steep(cols, rows, 1)
    search = raised(problem, GOALS[name], "default")
    tree = TreeBound(problem, GOALS[name].cost_model)
    for _ in range(100):
        tree.improve(search.cost)
    assert 0.0 < tree.bound < search.lower_bound < search.cost


def test_finer_counts_give_a_higher_bound():
    problem = steep(2, 4, 2, 0.17)
    bounds = [counted(problem, GOALS["straight"], arcs) for arcs in (0, 20_000_000)]
    for bound in bounds:
        bound.improve(20.0, step_lengths(60))
    assert bounds[0].blocks.arcs < bounds[1].blocks.arcs
    assert bounds[1].bound > 1.005 * bounds[0].bound


@pytest.mark.parametrize("name", ["straight", "routed", "time"])
def test_steep_sheets_come_with_a_bound_whatever_is_minimised(name):
    result = solve(steep(2, 3, 3, 0.08), effort="quick", objective=GOALS[name])
    assert result.lower_bound is not None
    assert 0.5 * result.cost < result.lower_bound <= result.cost


@pytest.mark.parametrize("limit", ["MOST_TRAVELS", "MOST_TOOLPATHS"])
def test_a_sheet_too_large_for_counts_gets_a_tree(monkeypatch, limit):
    monkeypatch.setattr(relaxed_bound, limit, 1)
    monkeypatch.setattr(PairBound, "over", None)
    search = raised(steep(2, 3, 4), GOALS["time"])
    assert 0.0 < search.lower_bound < search.cost


@pytest.mark.parametrize("method", ["greedy", "multistart", "local", "mcts", "aco"])
@pytest.mark.parametrize("name", ["straight", "routed", "time"])
def test_methods_that_bound_nothing_themselves_come_with_one(method, name):
    problem, goal = steep(2, 3, 3, 0.2), GOALS[name]
    result = solve(problem, method=method, effort="quick", objective=goal)
    best = solve(problem, method="auto", objective=goal)
    assert result.lower_bound is not None
    assert 0.3 * best.cost < result.lower_bound <= best.cost


def test_even_where_no_time_is_left(monkeypatch):
    problem = steep(2, 3, 3, 0.2)
    result = solve(problem, method="greedy", objective=GOALS["time"], time_limit_s=0.0)
    assert result.stopped
    assert 0.0 < result.lower_bound < result.cost
    monkeypatch.setattr(tree_bound, "LATE_UP_TO", problem.n - 1)
    assert solve(problem, method="greedy", objective=GOALS["time"], time_limit_s=0.0).lower_bound is None


def test_a_tree_aims_no_higher_than_its_bound_can_follow():
    """Greedy costs so much more than the optimum that steps towards it overshoot."""
    problem = steep(3, 4, 1)
    search = Search(problem, objective=GOALS["time"], effort="quick")
    start_greedily(search)
    raise_tree_bound(search)
    far = TreeBound(problem, GOALS["time"].cost_model)
    for _ in range(STEPS["quick"]):
        far.improve(search.cost)
    assert search.lower_bound > 1.01 * far.bound


def test_a_tree_takes_a_hop_that_is_joined_one_way_only_as_that_way():
    # From the one on the right up to the other a hop is extruded, and not back down.
    segments = np.array([[[0.0, 0.5], [1.0, 0.5]], [[1.2, 0.0], [2.2, 0.0]]])
    machine = replace(
        GOALS["uphill"], speed_mm_s=(30.0, 30.0, 30.0), acceleration_mm_s2=(500.0, 500.0, 500.0)
    )
    problem, goal = Problem.build(segments), replace(machine, clearance_mm=0.0)
    best = least_cost(goal, segments)
    for method in ("greedy", "multistart"):
        result = solve(problem, method=method, objective=goal)
        assert result.lower_bound <= best + 1e-9
        assert not result.proved or result.cost == pytest.approx(best)


@pytest.mark.parametrize("name", ["straight", "time"])
def test_over_counts_the_slope_is_that_of_the_bound(name):
    """On a steep sheet, where walks would often take what cannot follow."""
    bound = counted(steep(4, 4, 1), GOALS[name])
    random = np.random.default_rng(0)

    def at(multipliers: np.ndarray) -> tuple[float, np.ndarray]:
        bound._ascent = begin_ascent(multipliers)
        bound.improve(1.0, np.zeros(1))
        return float(bound._ascent.bound[0]), bound._ascent.direction / (1.0 - MOMENTUM)

    for _ in range(4):
        here = bound.best + random.normal(0.0, 0.05, len(bound.best))
        value, slope = at(here)
        for _ in range(3):
            way = random.normal(0.0, 1e-8, len(here))
            assert at(here + way)[0] - value == pytest.approx(float(slope @ way), abs=1e-10)


def test_what_cannot_follow_raises_the_bound_over_counts():
    problem = steep(4, 4, 1)
    bound, loose = counted(problem, GOALS["straight"]), counted(problem, GOALS["straight"])
    follows = loose.blocks.follows
    tops = np.repeat(np.arange(len(follows.top_start) - 1), np.diff(follows.top_start))
    steps = np.diff(follows.step_start)[tops]
    anything = follows._replace(
        start=np.concatenate([[0], np.cumsum(steps)]).astype(np.int32),
        steps=np.concatenate([np.arange(k) for k in steps]).astype(np.int32),
    )
    loose.blocks = loose.blocks._replace(follows=anything)
    for one in (bound, loose):
        one.improve(30.0, step_lengths(40, last=0.01))
    assert bound.bound > 1.02 * loose.bound


def test_counts_in_blocks_of_more_than_two_columns_are_refused():
    problem = steep(4, 2, 1)
    section = Section.whole(problem, GOALS["straight"])
    sets = relaxed_sets(section, 0)
    assert (sets.corridor == COUNTED).any()
    with pytest.raises(ValueError, match="two columns"):
        PairBound.over(section, sets, np.array([0, 2, 3], np.int32))


def test_a_sheet_with_too_many_counts_gets_a_tree(monkeypatch):
    monkeypatch.setitem(relaxed_bound.ARCS, "quick", 100_000)
    monkeypatch.setattr(PairBound, "over", None)
    search = raised(steep(2, 4, 1), GOALS["straight"])
    assert 0.0 < search.lower_bound < search.cost


def test_nor_is_what_may_follow_made_where_that_is_too_much(monkeypatch):
    monkeypatch.setattr(relaxed_columns, "MOST_FOLLOWING", 100)
    monkeypatch.setattr(PairBound, "over", None)
    search = raised(steep(2, 4, 1), GOALS["straight"])
    assert 0.0 < search.lower_bound < search.cost
    columns = columns_of(search.problem, GOALS["straight"])
    assert columns.sets(columns.coarsest) is None


def test_counts_that_cannot_be_told_apart_leave_a_bound(monkeypatch):
    segments = cut(hatch(generate.random_walk(4, 3, seed=1)).segments, BODY).segments
    problem = Problem.build(segments, body=BODY)
    monkeypatch.setattr(relaxed_bound, "few_down_sets", lambda section, most: None)
    told = raised(problem, GOALS["straight"])
    monkeypatch.setattr("slicer.sequence.states.counts_together.MOST_WORK", 0)
    assert 0.0 < raised(problem, GOALS["straight"]).lower_bound < told.lower_bound < told.cost


def columns_of(problem: Problem, goal: Objective) -> RelaxedColumns:
    return RelaxedColumns.of(Section.whole(problem, goal))


def bound_over(columns: RelaxedColumns, chosen: list[int]) -> PairBound:
    sets = columns.sets(chosen)
    return PairBound.over(columns.section, sets, cover(sets))


@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from(sorted(GOALS)))
def test_finer_states_see_no_less_at_the_same_multipliers(sheet, seed, name):
    """Whatever each column has, so that it is told of the multipliers of the toolpaths that they are about."""
    random = np.random.default_rng(seed)
    columns = columns_of(started(sheet(seed, 12, 3), seed), GOALS[name])
    coarse = bound_over(columns, columns.coarsest)
    coarse.best += random.normal(0.0, 0.05, len(coarse.best))
    # Prices of down-sets in between are about other states.
    coarse.best[coarse.block_costs.jumps.passing :] = 0.0
    coarse.use_best_multipliers()
    chosen = [int(random.integers(t, len(c))) for t, c in zip(columns.coarsest, columns.choices, strict=True)]
    finer = bound_over(columns, chosen)
    finer.go_on_from(coarse)
    finer.use_best_multipliers()
    if finer.block_costs.visits < finer.block_costs.visits_end:
        assert finer.bound >= coarse.bound - 1e-9


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(sorted(GOALS)), st.booleans())
def test_first_coarse_and_then_fine_it_stays_below_the_optimum(sheet, optimum, seed, name, exact):
    """Where all finer states are down-sets, travels are priced as they are made over walls."""
    problem = started(sheet(seed, 8, 2), seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(relaxed_bound, "few_down_sets", lambda section, most: None)
        patch.setattr(relaxed_columns, "MOST_DOWN_SETS", 1_000 if exact else 0)
        # The coarsest would be down-sets, and no walk would disagree.
        patch.setattr(RelaxedColumns, "_changes", all_but_at_first(RelaxedColumns._changes))
        patch.setattr(PairBound, "improve", never_at_rest(PairBound.improve))
        search = raised(problem, GOALS[name])
    best = optimum(problem, GOALS[name])
    if exact:
        best = max(best, solve(problem, method="exact", objective=GOALS[name]).cost)
    assert search.lower_bound <= best + 1e-9


def all_but_at_first(changes):
    """Nothing else to choose until the coarsest choice is made."""
    return lambda self, of_pair, chosen: () if chosen is self.coarsest else changes(self, of_pair, chosen)


def never_at_rest(improve):
    return lambda self, *given: improve(self, *given) and False


def test_steps_over_finer_counts_raise_the_bound_further(monkeypatch):
    problem = steep(3, 4, 1)
    both = raised(problem, GOALS["straight"], "default").lower_bound
    monkeypatch.setattr(RelaxedColumns, "finest", lambda self, *_: self.coarsest)
    assert both > 1.01 * raised(problem, GOALS["straight"], "default").lower_bound


def test_the_finest_states_are_no_more_than_may_be():
    columns = columns_of(steep(3, 4, 2, 0.17), GOALS["straight"])
    least = columns.arcs(columns.coarsest)
    arcs, held = [], []
    for most in (0, 2 * least, 10 * least, 100 * least):
        chosen = columns.finest(most)
        bound = bound_over(columns, chosen)
        arcs.append(bound.blocks.arcs)
        assert bound.blocks.arcs == columns.arcs(chosen) <= max(most, least)
        assert chosen == columns.finest(most, np.inf)
        held.append(_held(bound))
    assert arcs[0] == least
    assert arcs[0] < arcs[2] < arcs[3]
    for most in (held[0], 2 * held[0], held[3] // 2):
        assert _held(bound_over(columns, columns.finest(100 * least, most))) <= most


def _held(bound: PairBound) -> int:
    """What its states take, and as much again of those that are near, where these are most."""
    blocks = bound.blocks
    of_states = (
        *(blocks.move_start, blocks.move_path, blocks.move_to, blocks.move_value),
        *(blocks.value_start, blocks.value_path, blocks.dense, blocks.end_set),
        *(bound.block_costs.detour_start, bound.value),
    )
    return 2 * sum(part.nbytes for part in of_states)
