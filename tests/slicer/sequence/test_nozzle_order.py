"""Every method and every bound under a nozzle with a body and directions, against the optimum by brute force.

The precedence is not the package's: it is the definition in ``fields``, by shapely.
"""

import gc
import itertools
import weakref
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from exhaustive import least_cost, sequence_cost
from fields import allowed_by, closure, hindered, random_body, random_extension, segment_sets
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from printed import over_what_is_printed
from searching import searched

from slicer import grid
from slicer.cutting import cut
from slicer.errors import CycleError, SequenceError
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.streamed_bound import StreamedBound
from slicer.sequence.layered.exact_search import exact
from slicer.sequence.layered.layered_search import search_layers
from slicer.sequence.local_search.refinement import refine
from slicer.sequence.problem.directions import directed
from slicer.sequence.problem.neighbour_lists import neighbours
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search
from slicer.sequence.states.corridor import pairs_of, widest_corridor
from slicer.sequence.states.downsets import all_down_sets, down_sets
from slicer.sequence.states.joint_states import SAMPLED, closed_share, joint_states, out_of_reach
from slicer.sequence.states.section import Section
from slicer.sequence.states.tied_columns import join_tied_columns, states_of_all

STRAIGHT = Objective()
TIME = Objective("time", 0.2, (30.0, 50.0, 5.0), (500.0, 500.0, 50.0), fixed_s=0.05, fixed_from_mm=0.3)
PROVING = ("exact", "beam", "auto")
seeds = st.integers(0, 10**6)
downhill = st.sampled_from([90.0, 90.0, 0.0, 13.3, 47.7])


class Nozzled:
    """A problem, with precedence and directions by brute force beside it."""

    def __init__(self, problem, body, downhill_deg):
        self.problem = problem
        self.before = hindered(problem.segments, body)
        self.allowed = allowed_by(problem.segments, downhill_deg)

    def least(self, goal=STRAIGHT, last=None):
        problem = self.problem
        return least_cost(
            goal,
            problem.segments,
            problem.first,
            problem.first_flipped,
            last,
            skyline=False,
            before=self.before,
            allowed=self.allowed,
        )

    def least_over_what_is_printed(self, goal):
        problem = self.problem
        return least_cost(
            goal,
            problem.segments,
            problem.first,
            problem.first_flipped,
            before=self.before,
            allowed=self.allowed,
            travel=over_what_is_printed(problem, goal),
        )

    def assert_printable(self, order, flipped):
        assert sorted(order.tolist()) == list(range(self.problem.n))
        position = np.argsort(order)
        low, high = np.nonzero(self.before)
        assert (position[low] < position[high]).all()
        assert self.allowed[order, flipped.astype(int)].all()
        if self.problem.first is not None and len(order):
            assert order[0] == self.problem.first
        if self.problem.first_flipped is not None and len(order):
            assert bool(flipped[0]) == self.problem.first_flipped


def nozzled(segments, seed, downhill_deg):
    """A problem under a random nozzle, with its start fixed or not; without toolpaths that wait in a ring."""
    random = np.random.default_rng(seed)
    scale = float(np.hypot(*(segments[:, 1] - segments[:, 0]).T).mean()) if len(segments) else 1.0
    body = random_body(random, scale * random.choice([0.1, 0.3, 1.0]))
    while True:
        try:
            problem = Problem.build(segments, body=body, downhill_deg=downhill_deg)
            break
        except CycleError as rings:
            assert np.diagonal(closure(hindered(segments, body))).any()
            ring = rings.components[0]
            segments = np.delete(segments, ring[: len(ring) // 2], axis=0)
    first = random.choice(problem.starts) if problem.n and random.random() < 0.5 else None
    if first is not None:
        flipped = bool(first & 1) if random.random() < 0.5 else None
        problem = Problem.build(
            segments, body=body, downhill_deg=downhill_deg, first=int(first >> 1), first_flipped=flipped
        )
    return Nozzled(problem, body, downhill_deg)


@contextmanager
def blocks_of(seed):
    """Two columns to a block of the bound for half of the seeds; a small sheet is one block otherwise."""
    with pytest.MonkeyPatch.context() as patch:
        if seed % 2 == 0:
            patch.setattr("slicer.sequence.states.corridor.MERGED_STATES", 0)
            patch.setattr("slicer.sequence.layered.windows.MERGED_STATES", 0)
        yield


@settings(max_examples=25, deadline=None)
@given(segment_sets(max_n=4), seeds, downhill)
def test_the_brute_force_misses_nothing(segments, seed, down):
    of = nozzled(segments, seed, down)
    best = np.inf
    for order in itertools.permutations(range(of.problem.n)):
        if any(of.before[b, a] for a, b in itertools.combinations(order, 2)):
            continue
        if of.problem.first is not None and order[0] != of.problem.first:
            continue
        for flips in itertools.product([False, True], repeat=of.problem.n):
            if not of.allowed[list(order), np.array(flips, int)].all():
                continue
            if not flips or of.problem.first_flipped in (None, flips[0]):
                best = min(best, sequence_cost(STRAIGHT, of.problem.segments, order, flips))
    assert of.least() == pytest.approx(best, abs=1e-12)


@settings(max_examples=80, deadline=None)
@given(segment_sets(max_n=9), seeds)
def test_the_precedence_is_that_of_the_definition(segments, seed):
    of = nozzled(segments, seed, 90.0)
    below = np.zeros((of.problem.n, of.problem.n), bool)
    below[tuple(of.problem.edges.T)] = True
    assert (closure(below) == closure(of.before)).all()


@settings(max_examples=100, deadline=None)
@given(seeds, seeds, downhill)
def test_no_method_beats_all_linear_extensions(sheet, field, seed, down):
    of = nozzled(sheet(field, 8), seed, down)
    best = of.least()
    for method in METHODS:
        with blocks_of(seed):
            result = solve(of.problem, method=method, effort="quick", seed=seed)
        of.assert_printable(result.order, result.flipped)
        cost = sequence_cost(STRAIGHT, of.problem.segments, result.order, result.flipped)
        assert cost == pytest.approx(result.travel_mm)
        assert result.travel_mm >= best - 1e-9
        assert result.lower_bound_mm is None or result.lower_bound_mm <= best + 1e-9
        if result.proved or method in ("exact", "auto"):
            assert result.travel_mm == pytest.approx(best, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seeds, seeds, downhill, st.sampled_from(["straight", "time", "routed"]))
def test_no_method_breaks_precedence_or_directions(sheet, field, seed, down, name):
    of = nozzled(sheet(field, 45, 10), seed, down)
    goal = Objective(name, 0.2, (30.0, 50.0, 5.0), (500.0, 500.0, 50.0))
    for method in METHODS:
        with blocks_of(seed):
            result = solve(of.problem, method=method, effort="quick", seed=seed, objective=goal)
        of.assert_printable(result.order, result.flipped)


@settings(max_examples=60, deadline=None)
@given(seeds, seeds, downhill, st.sampled_from(PROVING), st.integers(1, 12))
def test_wherever_a_proof_is_stopped_its_bound_holds(sheet, field, seed, down, method, stop):
    of = nozzled(sheet(field, 8, 2), seed, down)
    said = []

    def hear(word):
        said.append(word)
        if len(said) == stop:
            raise KeyboardInterrupt

    with blocks_of(seed):
        found = searched(METHODS[method], of.problem, initial=dear_start(of, seed), progress=hear)
    best = of.least()
    assert found.lower_bound <= best + 1e-9
    for word in said:
        assert word.lower_bound is None or word.lower_bound <= best + 1e-9
        assert word.cost >= best - 1e-9


def dear_start(of, seed):
    """The dearest of some random sequences."""
    random = np.random.default_rng(seed)
    dearest = (-1.0, None)
    for _ in range(10):
        order = random_extension(random, of.problem.n, np.argwhere(of.before))
        if of.problem.first is not None:
            order = np.concatenate([[of.problem.first], order[order != of.problem.first]])
        flipped = np.where(
            of.allowed[order].all(axis=1), random.random(of.problem.n) < 0.5, of.allowed[order, 1]
        )
        if of.problem.first_flipped is not None:
            flipped[0] = of.problem.first_flipped
        of.assert_printable(order, flipped)
        cost = sequence_cost(STRAIGHT, of.problem.segments, order, flipped)
        dearest = max(dearest, (cost, (2 * order + flipped).astype(np.int32).tolist()))
    return np.array(dearest[1], np.int32)


@settings(max_examples=120, deadline=None)
@given(seeds, seeds, downhill, st.integers(1, 3), st.booleans(), st.booleans())
def test_what_a_narrow_search_cuts_off_is_not_below_its_bound(sheet, field, seed, down, width, noise, timed):
    of = nozzled(sheet(field, 8, 3), seed, down)
    goal = TIME if timed else STRAIGHT
    section = Section.whole(of.problem, goal)
    with blocks_of(seed):
        corridor = widest_corridor(section, dear_start(of, seed) >> 1, 10**6)
    bound = PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed)
    if noise:
        bound.best += np.random.default_rng(seed).normal(0.0, 0.5, len(bound.best))
    bound.use_best_multipliers()
    best = of.least(goal) if not timed or of.problem.body.is_point else of.least_over_what_is_printed(goal)
    assert bound.bound <= best + 1e-9
    if not timed:
        found = search_layers(Search(of.problem, objective=goal), bound, np.inf, width)
        assert found.finished
        assert found.cost >= best - 1e-9
        assert min(found.cost, found.lower_bound) <= best + 1e-9
        if found.oriented is not None:
            of.assert_printable(found.oriented >> 1, found.oriented & 1)
        everything = search_layers(Search(of.problem, objective=goal), bound, np.inf, 10**6)
        assert everything.cost == pytest.approx(best, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(seeds, seeds, downhill)
def test_the_streamed_bound_holds(sheet, field, seed, down):
    of = nozzled(sheet(field, 8, 3), seed, down)
    section = Section.whole(of.problem, STRAIGHT)
    assume(section.columns > 1)
    bound = StreamedBound(section, all_down_sets(section, 10**4))
    best = of.least()
    for _ in range(15):
        if not bound.step(0.05 * (best + 1.0), lambda: False):
            break
    assert bound.bound <= best + 1e-9


@settings(max_examples=60, deadline=None)
@given(seeds, seeds, downhill)
def test_joint_states_are_the_closed_ones(sheet, field, seed, down):
    of = nozzled(sheet(field, 14, 4), seed, down)
    section = Section.whole(of.problem, STRAIGHT)
    sets = down_sets(section, 10**6)
    bounds = np.array([0, max(1, section.columns - 1)][: 2 if section.columns > 1 else 1] or [0], np.int32)
    if section.columns == 1:
        bounds = np.array([0, 0], np.int32)
    states = joint_states(section, sets, bounds)
    members = [{int(sets.start[c]): frozenset()} for c in range(section.columns)]
    for c, known in enumerate(members):
        for i in range(sets.start[c], sets.start[c + 1]):
            for e in range(sets.step_start[i], sets.step_start[i + 1]):
                known[int(sets.step_to[e])] = known[i] | {int(sets.step_path[e])}
    shape = tuple(sets.counts.tolist())
    assume(np.prod(shape) < 20_000)
    ways = np.argwhere(of.before)
    for place in np.ndindex(shape):
        printed = frozenset().union(*(members[c][int(sets.start[c]) + i] for c, i in enumerate(place)))
        closed = all(a in printed for a, b in ways.tolist() if b in printed)
        assert closed == (True if states is None else bool(states[0][place])), printed


@settings(max_examples=40, deadline=None)
@given(seeds, seeds, st.integers(2, 60))
def test_joined_columns_have_the_down_sets_that_go_together(sheet, field, seed, most):
    of = nozzled(sheet(field, 14, 4), seed, 90.0)
    section = Section.whole(of.problem, STRAIGHT)
    joined = join_tied_columns(section, most)
    tied = len(section.ties) > 0
    assert tied or joined is section
    assert (np.diff(joined.column[np.argsort(section.column, kind="stable")]) >= 0).all()
    sets = down_sets(joined, 10**6)
    for c in range(joined.columns):
        inside = joined.column == c
        parts = np.unique(section.column[inside])
        x = of.problem.segments[inside][:, :, 0]
        assert joined.extent[c].tolist() == [x.min(), x.max()]
        if len(parts) > 1:
            assert sets.counts[c] <= most
            bounds = np.array([parts[0], parts[-1]], np.int32)
            together = joint_states(section, down_sets(section, 10**6), bounds)[0].sum()
            # Where a column holds the first toolpath, nothing else of it can be printed before.
            assert sets.counts[c] == together or (section.first >= 0 and sets.counts[c] < together)


def test_the_proof_of_a_sheet_whose_columns_are_tied():
    muscle = hatch(grid.read(Path(__file__).parents[2] / "data" / "tissue" / "muscle_us_8x8.json")).segments
    result = solve(Problem.build(muscle, body=NozzleBody.of(0.2, press_mm=0.05)))
    assert result.proved
    assert result.travel_mm == pytest.approx(83.80900059)


@pytest.mark.parametrize(("most_arcs", "widest"), [(150e6, 8347), (100e6, 5613), (50e6, 2971)])
def test_tied_columns_are_joined_as_far_as_all_states_can_be_held(most_arcs, widest):
    # The first two are as many columns, differently joined.
    brain = Path(__file__).parents[2] / "data" / "tissue" / "dti_small_101D_sagittal_10x10.json"
    body = NozzleBody.of(0.2, press_mm=0.05)
    problem = Problem.build(cut(hatch(grid.read(brain)).segments, body).segments, body=body)
    joined, corridor = states_of_all(problem, STRAIGHT, np.empty(0, np.int32), int(most_arcs))
    assert corridor.complete
    assert corridor.sets.counts.max() == widest
    assert joined.columns == (6 if widest == 2971 else 5)


def test_states_of_a_tied_sheet_are_found_once_and_go_with_their_problem():
    muscle = hatch(grid.read(Path(__file__).parents[2] / "data" / "tissue" / "muscle_us_8x8.json")).segments
    problem = Problem.build(muscle, body=NozzleBody.of(0.2, press_mm=0.05))
    guide = np.empty(0, np.int32)
    section, corridor = states_of_all(problem, STRAIGHT, guide, 10**8)
    assert corridor.complete
    again, same = states_of_all(problem, TIME, guide, 10**8)
    assert same is corridor
    assert (again.column == section.column).all()
    assert (again.extent == section.extent).all()
    assert (again.cost_model.timed, section.cost_model.timed) == (True, False)
    other = Problem.build(muscle, body=NozzleBody.of(0.2, press_mm=0.05))
    joined, found = states_of_all(other, STRAIGHT, guide, 10**8)
    assert (joined.column == section.column).all()
    assert found is not corridor
    assert (found.sets.counts == corridor.sets.counts).all()
    gone = weakref.ref(corridor)
    del problem, corridor, same
    gc.collect()
    assert gone() is None


def test_how_many_states_go_together_is_told_from_a_sample():
    brain = Path(__file__).parents[2] / "data" / "tissue" / "dti_small_101D_sagittal_10x10.json"
    body = NozzleBody.of(0.2, press_mm=0.05)
    problem = Problem.build(cut(hatch(grid.read(brain)).segments, body).segments, body=body)
    section = join_tied_columns(Section.whole(problem, STRAIGHT), 2_000)
    sets, bounds = all_down_sets(section, 20_000), pairs_of(section)
    assert sets.counts.max() > 5 * SAMPLED
    closed = joint_states(section, sets, bounds)
    share = sum(mask.sum() for mask in closed) / sum(mask.size for mask in closed)
    assert closed_share(section, sets, bounds) == pytest.approx(share, rel=0.2)
    assert closed_share(Section.whole(Problem.build(problem.segments), STRAIGHT), sets, bounds) == 1.0


def test_rounds_on_tied_columns_end_where_time_would_not_be_won_back(monkeypatch):
    muscle = hatch(grid.read(Path(__file__).parents[2] / "data" / "tissue" / "muscle_us_8x8.json")).segments
    problem = Problem.build(muscle[:300], body=NozzleBody.of(0.2, press_mm=0.05))
    rounds, results = [[], []], []
    monkeypatch.setattr("slicer.sequence.layered.exact_search.holds_whole", lambda bound: False)
    monkeypatch.setattr("slicer.sequence.layered.bounded_search.WHOLE", {"default": 1})
    for told, seconds in zip(rounds, (0.0, 1.0), strict=True):
        monkeypatch.setattr("slicer.sequence.layered.exact_search.SECONDS", seconds)
        monkeypatch.setattr("slicer.sequence.layered.exact_search.STANDSTILL", 1.0)
        monkeypatch.setattr("slicer.sequence.layered.exact_search.IN_REACH", 0.0)
        results.append(
            searched(
                partial(exact, thrifty=True),
                problem,
                objective=TIME,
                progress=lambda word, told=told: told.append(word.stage),
            )
        )
    assert rounds[1].count("search") < rounds[0].count("search")
    patient, hasty = results
    assert hasty.lower_bound <= patient.cost <= hasty.cost


MACHINE = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)


@pytest.mark.parametrize("method", ["exact", "auto"])
@pytest.mark.parametrize(("count", "cost"), [(210, None), (230, 10.173), (290, None)])
def test_a_proof_of_time_within_reach_is_made_on_tied_columns_too(count, cost, method):
    """A round may be dearer than what is left to gain: so near a proof it is all the same worth it."""
    muscle = hatch(grid.read(Path(__file__).parents[2] / "data" / "tissue" / "muscle_us_8x8.json")).segments
    problem = Problem.build(muscle[:count], body=NozzleBody.of(0.2, press_mm=0.05))
    result = solve(problem, method=method, objective=MACHINE)
    assert result.proved
    assert cost is None or result.cost == pytest.approx(cost, abs=1e-2)


STEPS = np.array([[[0.8, 5.0], [0.9, 5.0]], [[1.0, 0.0], [1.1, 0.0]], [[2.4, 4.9], [2.5, 4.9]]])
WIDE = NozzleBody.of(5.0)
"""The highest would stand in the way of those beside it, also of that two columns farther on."""


def test_columns_that_no_block_has_together_are_seen_by_the_search():
    section = Section.whole(Problem.build(STEPS, body=WIDE), STRAIGHT)
    sets = down_sets(section, 100)
    bound = PairBound.over(section, sets, np.array([0, 1, 2], np.int32))
    assert out_of_reach(section, bound.blocks.home).tolist() == [[2, 0]]
    bound.use_best_multipliers()
    found = search_layers(Search(Problem.build(STEPS, body=WIDE)), bound, np.inf, 100)
    assert (found.oriented >> 1).tolist() == [1, 2, 0]
    # Were the outer columns not tied to each other, 1, 0, 2 would cost less.
    assert found.cost == pytest.approx(np.hypot(1.4, 4.9) + np.hypot(1.5, 0.1))
    assert not bound.blocks.among(np.ones(len(bound.blocks.dense), np.bool_), sets)[0][1, 0]


@pytest.mark.parametrize("method", METHODS)
def test_uphill_only(method):
    # A zigzag over lines at 45 degrees would go down every other one.
    segments = np.array([[[0.0, k], [1.0, k + 1.0]] for k in range(5)])
    free = solve(Problem.build(segments), method=method, effort="quick")
    uphill = solve(Problem.build(segments, downhill_deg=30.0), method=method, effort="quick")
    assert free.travel_mm == pytest.approx(4.0)
    assert uphill.order.tolist() == [0, 1, 2, 3, 4]
    assert not uphill.flipped.any()
    assert uphill.travel_mm == pytest.approx(4.0)
    turned = solve(Problem.build(segments[:, ::-1], downhill_deg=30.0), method=method, effort="quick")
    assert turned.flipped.all()


def test_what_local_search_is_offered_is_allowed(sheet):
    for seed in range(20):
        of = nozzled(sheet(seed, 40, 10), seed, 20.0)
        near = neighbours(of.problem)
        allowed = of.allowed.ravel()
        for lists in (near.after, near.before):
            assert (lists[~allowed] == -1).all()
            assert allowed[lists[lists >= 0]].all()
        u, column = np.nonzero(near.after >= 0)
        v = near.after[u, column]
        # What rows of the precedence forbid together is not looked for here; what one row says is.
        rows = np.zeros_like(of.before)
        rows[of.problem.edges[:, 0], of.problem.edges[:, 1]] = True
        assert not rows[v >> 1, u >> 1].any()
        below = np.zeros_like(of.before)
        below[of.problem.below[:, 0], of.problem.below[:, 1]] = True
        assert not below[v >> 1, u >> 1].any()


def test_refinement_keeps_directions(sheet):
    for seed in range(10):
        of = nozzled(sheet(seed, 40, 10), seed, 20.0)
        search = Search(of.problem, objective=TIME, seed=seed, effort="quick")
        refined = refine(search, dear_start(of, seed))
        of.assert_printable(refined >> 1, refined & 1)


@settings(max_examples=60, deadline=None)
@given(seeds, seeds, downhill)
def test_directions_of_an_order_are_the_best_allowed(sheet, field, seed, down):
    of = nozzled(sheet(field, 8), seed, down)
    order = dear_start(of, seed) >> 1
    oriented = directed(of.problem, order)
    of.assert_printable(oriented >> 1, oriented & 1)
    chain = np.triu(np.ones((len(order), len(order)), bool), 1)
    before = np.zeros_like(chain)
    before[np.ix_(order, order)] = chain
    best = least_cost(
        STRAIGHT,
        of.problem.segments,
        first_flipped=of.problem.first_flipped,
        before=before,
        allowed=of.allowed,
    )
    assert of.problem.travel_mm(order, oriented & 1) == pytest.approx(best, abs=1e-9)


RISING = np.array([[[0.0, 0.0], [1.0, 1.0]], [[0.0, 1.0], [1.0, 2.0]]])


def test_an_impossible_start_says_so():
    with pytest.raises(SequenceError, match="first toolpath 0 not may|first_flipped True: first toolpath 0"):
        Problem.build(RISING, downhill_deg=0.0, first=0, first_flipped=True)
    with pytest.raises(SequenceError, match="no toolpath that can be printed first"):
        Problem.build(RISING, downhill_deg=0.0, first_flipped=True)
    assert Problem.build(RISING, downhill_deg=0.0, first_flipped=False).starts.tolist() == [0]
    with pytest.raises(SequenceError, match="toolpath 0 would stand in the nozzle's way of toolpath [12]"):
        Problem.build(STEPS, body=WIDE, first=0)


def test_an_initial_sequence_that_runs_down_is_refused():
    problem = Problem.build(RISING, downhill_deg=0.0)
    with pytest.raises(SequenceError, match=r"toolpath 1 runs down from \(1, 2\) to \(0, 1\) mm"):
        solve(problem, initial=([0, 1], [False, True]))
    assert not solve(problem, initial=[0, 1]).flipped.any()
    with pytest.raises(SequenceError, match="toolpath 2 is hindered by 0 but comes after it"):
        solve(Problem.build(STEPS, body=WIDE), initial=[1, 0, 2])


def test_an_initial_order_that_cannot_begin_so_is_refused():
    apart = np.array([[[0.0, 0.0], [1.0, 1.0]], [[3.0, 1.0], [4.0, 0.0]]])
    problem = Problem.build(apart, downhill_deg=0.0, first_flipped=True)
    assert problem.starts.tolist() == [3]
    assert solve(problem, initial=[1, 0]).order.tolist() == [1, 0]
    with pytest.raises(SequenceError, match="an order that begins with toolpath 0 cannot be printed"):
        solve(problem, initial=[0, 1])
