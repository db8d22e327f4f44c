"""What travels cost at least over what surely stands, against what they cost over every down-set."""

from itertools import product

import numpy as np
import pytest
from fields import hindered, random_body
from hypothesis import given, settings
from hypothesis import strategies as st
from printed import over_what_is_printed

from slicer import generate
from slicer.cutting import cut
from slicer.errors import CycleError
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem
from slicer.sequence.problem import Objective, least_travel_cost
from slicer.sequence.states import Section, least_over_certain
from slicer.sequence.states.certain_walls import MOST_PRICED

GOALS = {
    "routed": Objective("routed", 0.1),
    "time": Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0)),
    "fixed": Objective("time", 0.0, (30.0, 2.0, 50.0), (500.0, 20.0, 500.0), 0.05, 0.3),
    "joined": Objective(
        "time", 0.1, (50.0, 50.0, 5.0), fixed_s=0.02, join_mm=0.6, join_speed_mm_s=1.0, join_downhill_deg=40.0
    ),
}


def of_nozzle(segments, seed):
    """A problem under a nozzle with a body, and what must come before what, by definition; or None."""
    body = random_body(np.random.default_rng(seed), 0.2)
    try:
        return Problem.build(segments, body=body), hindered(segments, body)
    except CycleError:
        return None


def closed_sets(before):
    """All sets, as bits, that hold with each toolpath all that must come before it."""
    n = len(before)
    under = [sum(1 << int(t) for t in np.flatnonzero(before[:, s])) for s in range(n)]
    return [q for q in range(1 << n) if all(under[s] & ~q == 0 for s in range(n) if q >> s & 1)]


@pytest.mark.parametrize("goal", GOALS)
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_no_travel_costs_less_whatever_is_printed(sheet, goal, field, seed):
    made = of_nozzle(sheet(field, 7), seed)
    if made is None:
        return
    problem, before = made
    n, objective = problem.n, GOALS[goal]
    section = Section.whole(problem, objective)
    pairs, least = least_over_certain(section, np.zeros((n, 2), np.int32))
    known = dict(zip(map(tuple, pairs.tolist()), least.tolist(), strict=True))
    over = over_what_is_printed(problem, objective)
    sets = closed_sets(before)
    for printed, (u, v) in product(sets, known):
        s, t = u >> 1, v >> 1
        under = sum(1 << int(a) for a in np.flatnonzero(before[:, t]))
        last = printed >> s & 1 and not any(printed >> int(a) & 1 for a in np.flatnonzero(before[s]))
        if last and not printed >> t & 1 and under & ~printed == 0:
            cost = over(printed, u, v)
            assert known[u, v] <= cost + 1e-9
            least_set = 1 << s | under | sum(1 << int(a) for a in np.flatnonzero(before[:, s]))
            if goal == "routed" and printed == least_set and not before[s, t]:
                assert known[u, v] == pytest.approx(cost, rel=1e-6)  # nothing else stands


def test_on_a_random_walk_many_travels_surely_rise():
    body = NozzleBody.of(0.25, press_mm=0.02)
    segments = cut(hatch(generate.random_walk(3, 3, seed=1)).segments, body).segments
    section = Section.whole(Problem.build(segments, body=body), GOALS["time"])
    pairs, least = least_over_certain(section, np.zeros((section.n, 2), np.int32))
    ends = section.segments.reshape(-1, 2)
    across, up = (ends[pairs[:, 0] ^ 1] - ends[pairs[:, 1]]).T
    direct = [least_travel_cost(section.cost_model, x, y) for x, y in zip(across, up, strict=True)]
    assert (least > 1.1 * np.array(direct)).sum() > 500
    near = section.column[:, None] == section.column
    own, fewer = least_over_certain(section, np.stack([section.column, section.column], axis=1))
    inside = near[pairs[:, 0] >> 1, pairs[:, 1] >> 1]
    assert (own == pairs[inside]).all()
    assert (fewer == least[inside]).all()


def too_late(section):
    raise AssertionError("where nothing is told, nothing large is made")


def test_a_point_nothing_routed_or_too_much_to_price_tells_nothing(sheet, monkeypatch):
    segments = sheet(1, 7)
    every = np.zeros((len(segments), 2), np.int32)
    point = Section.whole(Problem.build(segments), GOALS["time"])
    assert len(least_over_certain(point, every)[0]) == 0
    made = next(filter(None, (of_nozzle(segments, seed) for seed in range(100))))
    straight = Section.whole(made[0], Objective())
    assert len(least_over_certain(straight, every)[0]) == 0
    assert MOST_PRICED > 10**6
    monkeypatch.setattr("slicer.sequence.states.certain_walls.comes_before", too_late)
    apart = [segments + [10.0 * k, 0.0] for k in range(1000)]
    long = Section.whole(Problem.build(np.concatenate(apart)), GOALS["time"])
    assert len(least_over_certain(long, np.zeros((long.n, 2), np.int32))[0]) == 0  # nothing of its square
    monkeypatch.undo()
    monkeypatch.setattr("slicer.sequence.states.certain_walls.MOST_PRICED", 0)
    routed = Section.whole(made[0], GOALS["time"])
    assert len(least_over_certain(routed, every)[0]) == 0
