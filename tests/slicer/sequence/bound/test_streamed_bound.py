"""The bound of large sheets: the column-pair bound, below the optimum at any prices, rising along its slope."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.bound import climb, open_streamed_bound, streamed_ascent
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.streamed_bound import EVERYTHING, StreamedBound
from slicer.sequence.construct import start_greedily
from slicer.sequence.portfolio import automatic
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Progress, Search
from slicer.sequence.states.downsets import all_down_sets
from slicer.sequence.states.section import Section


def walk(cols: int, rows: int, seed: int, first: int | None = 0, steepest: float = 45.0) -> Problem:
    """A random walk with wide spacing, so that there are a few toolpaths in each tile."""
    segments = hatch(random_walk(cols, rows, seed=seed, spacing_mm=0.3, low_deg=-steepest)).segments
    return Problem.build(segments, first=first)


def bound_of(problem: Problem) -> StreamedBound:
    section = Section.whole(problem, Objective())
    sets = all_down_sets(section, 100_000)
    assert sets is not None
    return StreamedBound(section, sets)


def evaluated(bound: StreamedBound, price: np.ndarray) -> tuple[float, np.ndarray]:
    """The bound at some prices and its slope there, after a first look for the start it is least for."""
    bound.price = price
    bound.evaluate(np.zeros_like(price), lambda: False)
    slope = np.zeros_like(price)
    value = bound.evaluate(slope, lambda: False)
    assert value is not None
    return value, slope


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), noise=st.booleans(), free=st.booleans())
def test_no_prices_make_the_bound_exceed_the_optimum(sheet, optimum, seed, noise, free):
    problem = Problem.build(sheet(seed, 8, 2))
    if not free:
        problem = Problem.build(problem.segments, first=int(problem.starts[seed % len(problem.starts)] >> 1))
    assume(problem.column.max() > 0)
    bound, best = bound_of(problem), optimum(problem)
    if noise:
        random = np.random.default_rng(seed).normal(0.0, 0.5, bound.price.shape)
        assert evaluated(bound, bound.price + random * bound.inner)[0] <= best + 1e-9
    else:
        for length in best * np.geomspace(0.16, 1e-3, 60):
            if not bound.step(length, lambda: False):
                break
        assert bound.bound <= best + 1e-9


@pytest.mark.parametrize("first", [0, None])
@pytest.mark.parametrize("seed", range(6))
def test_equals_the_bound_that_holds_all_states(seed, first):
    problem = walk(2 + seed, 4, seed, first)
    section = Section.whole(problem, Objective())
    sets = all_down_sets(section, 100_000)
    bound = StreamedBound(section, sets)
    held = PairBound.over(section, sets, np.arange(section.columns, dtype=np.int32))
    random = np.random.default_rng(seed)
    bound.price = bound.price + random.normal(0.0, 0.2, bound.price.shape) * bound.inner
    costs = held.block_costs
    prices = slice(int(costs.pair_start[-1]), costs.visits)
    oriented = (2 * bound.order[:, None] + [0, 1]).ravel()
    held.best[: prices.start] = 0.0
    held.best[prices].reshape(4, -1)[:, oriented] = bound.price
    # It knows nothing of who jumps where.
    costs.jumps.most[:] = np.where(np.isinf(costs.jumps.most), np.inf, costs.ways)
    held.use_best_multipliers()
    assert evaluated(bound, bound.price)[0] == pytest.approx(held.bound, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_the_slope_is_that_of_the_bound(seed):
    bound = bound_of(walk(5, 4, seed, None if seed % 2 else 0))
    random = np.random.default_rng(seed)
    price = bound.price + random.normal(0.0, 0.05, bound.price.shape) * bound.inner
    value, slope = evaluated(bound, price)
    assert np.abs(slope[:, bound.inner]).max() > 0
    for _ in range(5):
        direction = random.normal(0.0, 1e-7, price.shape) * bound.inner
        growth = evaluated(bound, price + direction)[0] - value
        assert growth == pytest.approx((slope * direction).sum(), abs=1e-11)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), slack=st.sampled_from([0.1, 0.3, 0.6]))
def test_fewer_states_bound_fewer_sequences(sheet, seed, slack):
    problem = Problem.build(sheet(seed, 30, 4))
    assume(problem.column.max() > 0)
    bound = bound_of(problem)
    everywhere, _ = evaluated(bound, bound.price)
    bound.look_at(slack)
    near, slope = evaluated(bound, bound.price)
    assert near >= everywhere - 1e-9
    if np.isfinite(near):
        before = bound.price  # the least of linear functions lies below each of them
        direction = np.random.default_rng(seed).normal(0.0, 0.1, before.shape) * bound.inner
        assert evaluated(bound, before + direction)[0] <= near + (slope * direction).sum() + 1e-9
        bound.price = before
    bound.look_at(EVERYTHING)
    assert evaluated(bound, bound.price)[0] == pytest.approx(everywhere, abs=1e-9)


def test_a_corridor_that_is_too_narrow_is_widened(monkeypatch):
    search = Search(walk(8, 6, 3))
    start_greedily(search)
    known = solve(search.problem).lower_bound_mm
    looked_at: list[float] = []
    look_at = StreamedBound.look_at
    monkeypatch.setattr(
        StreamedBound, "look_at", lambda b, slack: (looked_at.append(slack), look_at(b, slack))[1]
    )
    monkeypatch.setattr(streamed_ascent, "PACE", 1.5)
    bound = open_streamed_bound(search)
    assert climb(search, bound)
    paces = sorted({slack for slack in looked_at if slack < EVERYTHING})
    assert len(paces) > 1
    assert paces[1] == 2 * paces[0]
    assert 0.95 * known < search.lower_bound <= known + 1e-9


def test_steps_raise_the_bound():
    problem = walk(8, 6, 3)
    optimum = solve(problem, effort="high").travel_mm
    bound = bound_of(problem)
    bound.step(0.1 * optimum, lambda: False)
    first = bound.bound
    for length in optimum * np.geomspace(0.1, 0.01, 30):
        bound.step(length, lambda: False)
    assert 0.9 * optimum < first < bound.bound <= optimum + 1e-9


def test_a_large_sheet_is_bounded_as_far_as_the_effort_goes(monkeypatch):
    problem = walk(9, 9, 1)
    proved = solve(problem, effort="high")
    assert proved.proved
    known = proved.lower_bound_mm
    monkeypatch.setitem(automatic.BEAM_UP_TO, "quick", 100)
    heard: list[Progress] = []
    result = solve(problem, effort="quick", progress=heard.append)
    assert 0.9 * known < result.lower_bound_mm <= known + 1e-9
    assert heard[-1].lower_bound == pytest.approx(result.lower_bound_mm)
    assert not result.stopped


def test_columns_at_different_heights_do_not_send_the_ascent_downhill():
    segments = [
        [[10.0 * c, y + 10.0 * k], [10.0 * c + 10.0, y + 10.0 * k]]
        for c, y in enumerate([0.0, 100.0] * 3)
        for k in range(2)
    ]
    problem = Problem.build(np.array(segments), first=None)
    optimum = solve(problem).travel_mm
    bound = bound_of(problem)
    bound.step(0.1 * optimum, lambda: False)
    first = bound.bound
    for share in np.geomspace(0.16, 0.01, 80):
        if not bound.step(share * (optimum + max(0.0, -bound.bound)), lambda: False):
            break
    assert first < 0.0
    assert first / 5 < bound.bound <= optimum + 1e-9


@pytest.mark.parametrize("name", ["MOST_VALUES", "STRETCH"])
def test_a_bound_that_would_take_too_much_is_left_out(name, monkeypatch):
    monkeypatch.setitem(automatic.BEAM_UP_TO, "quick", 100)
    monkeypatch.setattr(streamed_ascent, name, 0)
    heard: list[Progress] = []
    found = solve(walk(9, 9, 1), effort="quick", progress=heard.append)
    assert any("too" in word.stage for word in heard)
    assert 0.0 < found.lower_bound_mm < found.travel_mm  # another one stands in


def test_two_columns_have_no_prices_and_so_one_step():
    bound = bound_of(walk(2, 6, 1))
    assert not bound.step(1.0, lambda: False)
    assert np.isfinite(bound.bound)


def test_a_bound_told_before_ctrl_c_is_kept(monkeypatch):
    monkeypatch.setitem(automatic.BEAM_UP_TO, "default", 100)
    told: list[float] = []

    def interrupt(word: Progress) -> None:
        if word.stage == "bound":
            told.append(word.lower_bound)
            raise KeyboardInterrupt

    result = solve(walk(9, 9, 1), progress=interrupt)
    assert result.stopped
    assert result.lower_bound_mm == pytest.approx(told[0])


def test_a_column_with_too_many_down_sets_is_left_to_coarser_states_and_says_so(monkeypatch):
    monkeypatch.setitem(automatic.BEAM_UP_TO, "quick", 100)
    monkeypatch.setattr(streamed_ascent, "MOST_DOWN_SETS", 0)
    heard: list[Progress] = []
    result = solve(walk(9, 9, 1, None, 89.0), effort="quick", progress=heard.append)
    assert "columns with too many down-sets for a bound" in [word.stage for word in heard]
    assert 0.0 < result.lower_bound_mm < result.travel_mm
