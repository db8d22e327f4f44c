"""What a travel costs, against numbers worked out by hand, and what an ``Objective`` refuses."""

import numpy as np
import pytest
from exhaustive import route, seconds, sequence_cost
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.errors import SequenceError
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.sequence_cost import true_cost
from slicer.sequence.problem.travel_cost import direct_cost, leg_cost

INF = np.inf
MACHINE = {"speed_mm_s": (60.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 250.0, 50.0)}
"""Path, x and y."""
TIME = Objective("time", **MACHINE)
LEGS = {
    # v = 50 (x), a = 250 (x): 0.2 s and 5 mm up and down each, 90 mm at 50 mm/s in between
    "long, level": (TIME, 100.0, 0.0, 0.2 + 90 / 50 + 0.2),
    # full speed needs 10 mm: half of 1 mm in t = √(2 * 0.5 / 250) = 0.063246 s, twice
    "short, level": (TIME, 1.0, 0.0, 2 * 0.0632455532),
    "speed just reached": (TIME, 10.0, 0.0, 0.4),
    # v = 5, a = 50 (y): 0.1 s and 0.25 mm up and down each
    "long, upright": (TIME, 0.0, 10.0, 0.1 + 9.5 / 5 + 0.1),
    # 0.1 mm: 0.05 mm in √(2 * 0.05 / 50) = 0.0447214 s, twice
    "short, upright": (TIME, 0.0, 0.1, 2 * 0.0447213595),
    # 3-4-5: y allows 5 / 0.8 = 6.25 mm/s and 50 / 0.8 = 62.5 mm/s² along the path, x and path more;
    # 0.1 s and 0.3125 mm up and down each, 49.375 mm at 6.25 mm/s
    "diagonal, slow in y": (TIME, 30.0, 40.0, 0.1 + 49.375 / 6.25 + 0.1),
    "diagonal, leftwards and down": (TIME, -30.0, -40.0, 0.1 + 49.375 / 6.25 + 0.1),
    # x allows 8 / 0.6 = 13.33 mm/s, y 20 / 0.8 = 25, the path 12; acceleration: 30 / 0.6 = 50, 48 / 0.8 = 60
    "diagonal, speed of the path and ramp of x": (
        Objective("time", speed_mm_s=(12.0, 8.0, 20.0), acceleration_mm_s2=(100.0, 30.0, 48.0)),
        3.0,
        4.0,
        0.24 + (5.0 - 12 * 0.24) / 12 + 0.24,
    ),
    "diagonal, speed of x and ramp of the path": (
        Objective("time", speed_mm_s=(20.0, 6.0, 20.0), acceleration_mm_s2=(40.0, 30.0, 48.0)),
        3.0,
        4.0,
        0.25 + (5.0 - 10 * 0.25) / 10 + 0.25,
    ),
    "no ramps": (Objective("time", speed_mm_s=(60.0, 50.0, 5.0)), 100.0, 0.0, 2.0),
    "no ramps, diagonal": (Objective("time", speed_mm_s=(60.0, 50.0, 5.0)), 30.0, 40.0, 8.0),
    "nowhere": (TIME, 0.0, 0.0, 0.0),
    "straight counts mm": (Objective("straight", **MACHINE), 30.0, 40.0, 50.0),
    "routed counts mm": (Objective("routed", **MACHINE), 30.0, 40.0, 50.0),
}


@pytest.mark.parametrize("name", LEGS)
def test_a_leg_costs_what_was_worked_out_by_hand(name):
    objective, dx, dy, expected = LEGS[name]
    assert leg_cost(objective.cost_model, dx, dy) == pytest.approx(expected, rel=1e-8)
    if objective.name == "time" and expected:
        assert seconds(objective, dx, dy) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("downhill", "joined"), [(90.0, "udls"), (46.0, "uls"), (45.0, "uls"), (44.0, "ul"), (0.0, "ul")]
)
def test_a_hop_is_joined_unless_it_leads_down_too_steeply(downhill, joined):
    """Up, down, level and slanting down by 45 degrees."""
    goal = Objective(
        "time", **MACHINE, fixed_s=9.0, join_mm=1.0, join_speed_mm_s=1.0, join_downhill_deg=downhill
    )
    hops = {"u": (0.0, 0.5), "d": (0.0, -0.5), "l": (-0.5, 0.0), "s": (0.3, -0.3)}
    assert "".join(k for k, hop in hops.items() if direct_cost(goal.cost_model, *hop) < 9.0) == joined


lengths = st.floats(-200, 200).filter(lambda x: x == 0 or abs(x) > 1e-3)
limits = st.tuples(*[st.floats(0.1, 1000)] * 3)


@settings(max_examples=200, deadline=None)
@given(lengths, lengths, limits, limits)
def test_a_leg_costs_what_another_derivation_says(dx, dy, speed, acceleration):
    objective = Objective("time", speed_mm_s=speed, acceleration_mm_s2=acceleration)
    expected = seconds(objective, dx, dy) if dx or dy else 0.0
    assert leg_cost(objective.cost_model, dx, dy) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (Objective("time", **MACHINE, fixed_s=0.3), 2.5),
        (Objective("time", **MACHINE, fixed_s=0.3, fixed_from_mm=99.9), 2.5),
        (Objective("time", **MACHINE, fixed_s=0.3, fixed_from_mm=100.1), 2.2),
        (Objective("routed", **MACHINE, fixed_s=0.3), 100.0),
        (Objective("straight", **MACHINE, fixed_s=0.3), 100.0),
    ],
)
def test_the_fixed_time_is_for_long_travels_and_for_time_alone(objective, expected):
    assert direct_cost(objective.cost_model, 100.0, 0.0) == pytest.approx(expected)
    apart = Problem.build([[[0.0, 0.0], [1.0, 0.0]], [[101.0, 0.0], [102.0, 0.0]]])
    assert true_cost(apart, objective, np.array([0, 2], np.int32)) == pytest.approx(expected)
    assert solve(apart, method="greedy", objective=objective).cost == pytest.approx(expected)


def test_a_detour_stops_at_each_corner_and_pays_the_fixed_time_once():
    wall_and_floors = np.array([[[2.0, 0.0], [2.0, 5.0]], [[0.0, 0.0], [1.0, 0.0]], [[3.0, 0.0], [4.0, 0.0]]])
    problem = Problem.build(wall_and_floors)
    sequence = np.array([0, 2, 4], np.int32)
    # From the wall's top (2, 5) down to (0, 0): √29. From (1, 0) over the wall to (3, 0): up 0.5, twice
    # √(1 + 25) = 5.0990195, down 0.5.
    over = 0.5 + 2 * 5.0990195136 + 0.5
    routed = Objective("routed", clearance_mm=0.5)
    assert true_cost(problem, routed, sequence) == pytest.approx(5.3851648071 + over)
    assert true_cost(problem, Objective(), sequence) == pytest.approx(5.3851648071 + 2.0)
    # 1 mm/s and 1 mm/s² along the path: a leg of 0.5 mm never gets to 1 mm/s and takes 2 * √0.5 s, a longer
    # one takes 1 s more than its mm. The first travel is shorter than 5.4 mm, the second longer.
    timed = Objective("time", 0.5, (1.0, 99.0, 99.0), (1.0, INF, INF), fixed_s=10.0, fixed_from_mm=5.4)
    detour = 2 * 2 * 0.5**0.5 + 2 * (5.0990195136 + 1)
    assert true_cost(problem, timed, sequence) == pytest.approx(5.3851648071 + 1 + detour + 10)
    for goal in (Objective(), routed, timed):
        assert sequence_cost(goal, problem.segments, [0, 1, 2], [0, 0, 0]) == pytest.approx(
            true_cost(problem, goal, sequence)
        )
    assert route(problem.segments[:2], (1.0, 0.0), (3.0, 0.0), 0.5) == [
        (1, 0),
        (1, 0.5),
        (2, 5.5),
        (3, 0.5),
        (3, 0),
    ]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"name": "beauty"}, "there is no objective 'beauty'; there are straight, routed, time"),
        ({"name": ["time"]}, "there is no objective"),
        ({"speed_mm_s": (1.0, 0.0, 1.0)}, "speed_mm_s, x axis: 0 must be between 1e-06 and 1e"),
        ({"speed_mm_s": (-1.0, 1.0, 1.0)}, "speed_mm_s, travel: -1 must be"),
        ({"speed_mm_s": (1.0, 1.0, INF)}, "speed_mm_s, y axis: inf must be"),
        ({"speed_mm_s": (INF, INF, INF)}, "speed_mm_s, travel: inf must be"),
        ({"speed_mm_s": (1.0, np.nan, 1.0)}, "speed_mm_s, x axis: nan must be"),
        ({"speed_mm_s": (1.0, 1e-320, 1.0)}, "speed_mm_s, x axis"),
        ({"speed_mm_s": 10.0}, "speed_mm_s 10.0 must be three numbers"),
        ({"speed_mm_s": (1.0, 1.0)}, "must be three numbers"),
        ({"speed_mm_s": "123"}, "must be three numbers"),
        ({"speed_mm_s": ("1", 1.0, 1.0)}, "speed_mm_s, travel: '1' must be a number"),
        ({"acceleration_mm_s2": (1.0, 0.0, 1.0)}, "acceleration_mm_s2, x axis: 0 must be at least 1e-06"),
        ({"acceleration_mm_s2": (1.0, 1.0, -2.0)}, "acceleration_mm_s2, y axis: -2 .* inf for no limit"),
        ({"acceleration_mm_s2": (np.nan, 1.0, 1.0)}, "acceleration_mm_s2, travel: nan"),
        ({"clearance_mm": -0.1}, "clearance_mm -0.1 must be between 0 and"),
        ({"clearance_mm": np.nan}, "clearance_mm nan"),
        ({"clearance_mm": INF}, "clearance_mm inf"),
        ({"clearance_mm": "0.2"}, "clearance_mm '0.2' must be a number"),
        ({"clearance_mm": True}, "clearance_mm True must be a number"),
        ({"fixed_s": -1.0}, "fixed_s -1 must be"),
        ({"fixed_s": np.nan}, "fixed_s nan"),
        ({"fixed_s": INF}, "fixed_s inf"),
        ({"fixed_from_mm": -1.0}, "fixed_from_mm -1 must be at least 0"),
        ({"fixed_from_mm": np.nan}, "fixed_from_mm nan"),
    ],
)
def test_an_objective_refuses_numbers_that_mean_nothing(values, words):
    with pytest.raises(SequenceError, match=words):
        Objective(**{"name": "time", **values})


def test_an_objective_takes_any_kind_of_number():
    objective = Objective("time", 0, np.array([1, 2, 3]), [np.float32(4), INF, 5], np.int64(1), INF)
    assert objective.speed_mm_s == (1.0, 2.0, 3.0)
    assert objective.acceleration_mm_s2 == (4.0, INF, 5.0)
    assert hash(objective) == hash(Objective("time", 0.0, (1.0, 2.0, 3.0), (4.0, INF, 5.0), 1.0, INF))


LINES = np.array([[[x, y], [x + 0.4, y + 0.1]] for x in range(3) for y in range(3)])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("goal", ["straight", "routed", "time"])
@pytest.mark.parametrize("segments", [LINES * 1e-3 + 99_999.0, (LINES - 1.5) * 6e4], ids=["far out", "wide"])
def test_sheets_at_the_bounds_are_served(segments, goal, method):
    for speed, acceleration in ((1.0, INF), (1e9, 1e-4), (1e9, INF)):
        objective = Objective(goal, 1e5, (speed,) * 3, (acceleration,) * 3, 1e4, 0.0)
        result = solve(segments, first=None, method=method, effort="quick", objective=objective)
        assert np.isfinite(result.cost)
        assert Problem.build(segments).refusal(result.order) is None


@pytest.mark.parametrize("method", ["auto", "local", "aco"])
def test_a_travel_of_days_is_refused_where_rounding_would_feign_gains(method):
    goal = Objective("time", speed_mm_s=(1e-6, 1e-6, 1e-6))
    with pytest.raises(SequenceError, match="2.4 x 2.1 mm costs .* s, but must not cost more than 300000"):
        solve(LINES, first=None, method=method, effort="quick", objective=goal)
