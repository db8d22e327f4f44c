"""What a library call refuses: always a ``SequenceError`` that says what to give instead."""

import numpy as np
import pytest
from searching import searched

from slicer.errors import CrossingError, SequenceError, SlicerError
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.problem.directions import directed
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.sequence_cost import true_cost


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


THREE = np.array([line(0, k, 1, k) for k in range(3)], float)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "magic"}, "there is no method 'magic'"),
        ({"method": ["auto"]}, "there is no method"),
        ({"effort": "heroic"}, "there is no effort 'heroic'"),
        ({"effort": None}, "there is no effort 'None'"),
        ({"objective": "beauty"}, "there is no objective 'beauty'"),
        ({"objective": None}, "there is no objective 'None'"),
        ({"time_limit_s": -1.0}, "time_limit_s -1 must be at least 0. Give seconds, or None"),
        ({"time_limit_s": np.nan}, "time_limit_s nan must be at least 0"),
        ({"time_limit_s": "1"}, "time_limit_s '1' must be a number"),
        ({"time_limit_s": True}, "time_limit_s True must be a number"),
        ({"workers": 0}, "workers 0 must be at least 1"),
        ({"workers": 1.5}, "workers 1.5 must be a whole number. Give the number of processes"),
        ({"workers": "2"}, "workers '2' must be a whole number"),
        ({"workers": True}, "workers True must be a whole number"),
        ({"seed": -1}, "seed -1 must be at least 0"),
        ({"seed": 0.5}, "seed 0.5 must be a whole number"),
        ({"seed": "0"}, "seed '0' must be a whole number"),
        ({"seed": None}, "seed None must be a whole number"),
        ({"first": 1.5}, "first toolpath 1.5 must be a whole number. Give the index"),
        ({"first": "0"}, "first toolpath '0' must be a whole number"),
        ({"first": True}, "first toolpath True must be a whole number"),
        ({"first": np.True_}, "first toolpath .*True.* must be a whole number"),
        ({"first": -1}, "first toolpath -1: there are 3"),
        ({"first_flipped": "no"}, "first_flipped 'no' must be True or False. Give None"),
        ({"first_flipped": 0.0}, "first_flipped 0.0 must be True or False"),
        ({"first_flipped": 2}, "first_flipped 2 must be True or False"),
        ({"initial": [0, 1]}, "shape"),
        ({"initial": [0, 0, 1]}, "exactly once"),
        ({"initial": [0.0, 1.0, 2.0]}, "whole numbers"),
        ({"initial": [2, 1, 0]}, "begins with toolpath 2, not 0"),
        ({"initial": [0, 2, 1]}, "toolpath 1 lies below 2"),
        ({"initial": ([0, 1, 2], [True])}, "directions"),
    ],
)
def test_wrong_use_is_refused_in_words(options, words):
    with pytest.raises(SequenceError, match=words):
        solve(THREE, **options)


def test_numpys_numbers_are_as_good_as_pythons():
    result = solve(
        THREE,
        first=np.int32(0),
        first_flipped=np.True_,
        seed=np.uint8(7),
        workers=np.int64(1),
        time_limit_s=np.float32(5),
        method="local",
        effort="quick",
    )
    assert result.flipped[0]
    assert solve(THREE, time_limit_s=np.inf).proved
    assert solve(THREE, time_limit_s=5).proved


@pytest.mark.parametrize(
    ("segments", "error", "words"),
    [
        ("lines", SequenceError, "segments cannot be read as numbers"),
        ([[[0, 0], [1]]], SequenceError, "segments cannot be read as numbers"),
        ([[[0, 0], [1, None]]], SlicerError, "not a finite number|cannot be read"),
        ([[0.0, 1.0]], SequenceError, r"segments have shape \(1, 2\)"),
        ([line(0, 0, 1, 0), line(0, 1, 1, 1e160)], SequenceError, r"toolpath 1 reaches y = 1e\+160 mm"),
        ([line(0, 0, 1, 0), line(-1.1e5, 1, 1, 1)], SequenceError, "toolpath 1 reaches x = -110000 mm"),
        ([line(0, 0, 1, np.inf)], SlicerError, "toolpath 0 has a coordinate that is not a finite number"),
        ([line(0, 0, 1, np.nan)], SlicerError, "toolpath 0 has a coordinate that is not a finite number"),
        ([line(0, 0, 1, 1), line(0, 1, 1, 0)], CrossingError, "crosses"),
    ],
)
def test_toolpaths_that_cannot_be_ordered_are_refused(segments, error, words):
    with pytest.raises(error, match=words):
        solve(segments)


def test_a_list_of_whole_numbers_is_a_sheet():
    assert solve([[[0, 0], [1, 0]], [[0, 1], [1, 1]]]).travel_mm == 1.0
    assert solve([]).travel_mm == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_toolpaths_without_length_do_no_harm(method):
    points = np.array([line(x, y, x, y) for x in range(3) for y in range(3)], float)
    for objective in ("straight", "routed", "time"):
        result = solve(points, first=None, method=method, effort="quick", objective=objective)
        assert sorted(result.order.tolist()) == list(range(9))
        assert result.cost >= 8.0 - 1e-9  # at least 1 mm, and 1 s, from each to the next


def smuggled(field, value):
    """An objective that no constructor lets through."""
    objective = Objective("time")
    object.__setattr__(objective, field, value)
    return objective


@pytest.mark.parametrize("method", ["auto", "local", "aco", "multistart"])
@pytest.mark.parametrize(
    "objective",
    [
        smuggled("speed_mm_s", (np.inf,) * 3),
        smuggled("speed_mm_s", (np.nan,) * 3),
        smuggled("acceleration_mm_s2", (np.nan,) * 3),
        smuggled("fixed_s", np.inf),
    ],
    ids=["endless speed", "no speed", "no acceleration", "endless wait"],
)
def test_costs_that_are_no_numbers_reach_no_kernel(method, objective):
    # They used to become indices of compiled code, which wrote where it should not.
    problem = Problem.build([line(x, y, x + 0.5, y) for x in range(6) for y in range(6)])
    if method == "multistart":  # does not look for neighbours
        assert problem.refusal(searched(METHODS[method], problem, objective=objective).oriented >> 1) is None
        return
    with pytest.raises(SequenceError, match="must not cost more than 300000"):
        searched(METHODS[method], problem, effort="quick", objective=objective)


@pytest.mark.parametrize("oriented", [[0, 2, 6], [0, -1, 2], [0, 2, 2**31 - 1]])
@pytest.mark.parametrize("goal", ["straight", "routed", "time"])
def test_a_sequence_of_what_does_not_exist_has_no_cost(goal, oriented):
    problem = Problem.build(THREE)
    with pytest.raises(AssertionError, match="3 toolpaths holds one that does not exist"):
        true_cost(problem, Objective(goal), np.array(oriented, np.int32))
    assert true_cost(problem, Objective(), directed(problem, [0, 1, 2])) == 2.0
