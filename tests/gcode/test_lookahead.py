"""Speeds at corners by arithmetic: what Marlin and Klipper say of their planners, on moves of known answer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcode.lookahead import Queue, klipper_times, marlin_times


def queue(points, speed=100.0, acceleration=1000.0):
    """Moves from point to point (x, y, depth, e), begun at rest."""
    change = np.diff(np.array([(*point, *(0,) * (4 - len(point))) for point in points], float), axis=0)
    path = np.sqrt((change[:, :3] ** 2).sum(axis=1))
    moves = path > 0
    length = np.where(moves, path, np.abs(change[:, 3]))
    m = len(length)
    begins = np.zeros(m, bool)
    begins[:1] = True
    return Queue(
        unit=change / np.sqrt((change**2).sum(axis=1, keepdims=True)),
        length=length,
        speed=np.full(m, speed),
        acceleration=np.full(m, acceleration),
        asked=np.full(m, acceleration),
        axis_acceleration=np.full((m, 4), 1e6),
        begins=begins,
        moves_nozzle=moves,
        fed=np.where(moves, change[:, 3] / length, 0.0),
    )


def from_rest(length, through, speed=100.0, a=1000.0):
    """Seconds of a move that begins at rest and ends with the speed ``through``."""
    ramps = (speed**2 + speed**2 - through**2) / (2 * a)
    assert ramps <= length
    return speed / a + (speed - through) / a + (length - ramps) / speed


@pytest.mark.parametrize("corner", [1.0, 5.0, 20.0])
def test_klipper_takes_a_right_angle_at_the_square_corner_velocity(corner):
    took = klipper_times(queue([(0, 0), (50, 0), (50, 50)]), corner, 0.0)
    assert took == pytest.approx([from_rest(50, corner)] * 2)


@pytest.mark.parametrize(
    ("points", "corner"), [([(0, 0), (50, 0), (0, 0)], 0.0), ([(0, 0), (50, 0), (100, 0)], 100.0)]
)
def test_klipper_stops_where_the_path_turns_back_and_runs_on_where_it_goes_on(points, corner):
    assert klipper_times(queue(points), 5.0, 0.0) == pytest.approx([from_rest(50, corner)] * 2)


@pytest.mark.parametrize("ratio", [0.0, 0.25, 0.5, 0.9])
def test_klipper_keeps_its_least_part_of_a_short_move_at_constant_speed(ratio):
    length, a = 2.0, 1000.0
    (took,) = klipper_times(queue([(0, 0), (length, 0)], speed=500.0), 5.0, ratio)
    peak = np.sqrt((1 - ratio) * length * a)
    assert took == pytest.approx(2 * peak / a + ratio * length / peak)


def test_klipper_ends_at_rest_before_the_feed_moves_alone():
    took = klipper_times(queue([(0, 0), (50, 0), (50, 0, 0, -1), (100, 0)]), 5.0, 0.0)
    assert took[0] == took[2] == pytest.approx(from_rest(50, 0.0))
    assert took[1] == pytest.approx(2 * np.sqrt(1 / 1000.0))


def test_klipper_lets_the_feed_jump_no_faster_than_its_instant_corner():
    took = klipper_times(queue([(0, 0), (50, 0, 0, 0), (100, 0, 0, 5)]), 5.0, 0.0)
    assert took == pytest.approx([from_rest(50, 1.0 / 0.1)] * 2)


def test_marlin_takes_a_right_angle_as_junction_deviation_says():
    sine = np.sqrt(0.5)
    square = 1000.0 * 0.1 * sine / (1 - sine)
    took = marlin_times(queue([(0, 0), (50, 0), (50, 50)]), np.full(2, 0.1))
    assert took == pytest.approx([from_rest(50, np.sqrt(square))] * 2)


place = st.tuples(st.integers(-20, 20), st.integers(-20, 20))


@given(st.lists(place, min_size=2, max_size=30), st.floats(1, 300), st.floats(0, 0.9), st.floats(0, 50))
def test_no_planner_is_faster_than_its_speed_or_slower_than_stops_at_every_corner(
    points, speed, ratio, corner
):
    points = [p for k, p in enumerate(points) if k == 0 or p != points[k - 1]]
    if len(points) < 2:
        return
    moves = queue(points, speed)
    stops = klipper_times(moves, 0.0, ratio)
    for took in (klipper_times(moves, corner, ratio), marlin_times(moves, np.full(len(moves.length), 0.05))):
        assert (took >= moves.length / speed * (1 - 1e-9)).all()
        assert np.isfinite(took).all()
    assert klipper_times(moves, corner, ratio).sum() <= stops.sum() * (1 + 1e-9)
    assert (np.diff(klipper_times(moves, 5.0, 0.0).cumsum(), prepend=0) >= 0).all()
