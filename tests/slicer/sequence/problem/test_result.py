"""When a result counts as proved, and how it says so."""

import numpy as np
import pytest

from slicer.sequence import Result, solve


def result(travel, bound):
    return Result(
        np.arange(2), np.zeros(2, bool), travel, bound, 0, 0, "exact", 0, 0.0, cost=travel, lower_bound=bound
    )


@pytest.mark.parametrize(
    ("travel", "bound", "proved"),
    [
        (100.0, 100.0, True),
        (100.0, 100.0 - 1e-8, True),  # rounding
        (100.0, 100.0 - 1e-6, False),
        (1e5, 1e5 - 1e-5, True),
        (1e5, 1e5 - 1e-3, False),
        (2e-6, 1.9e-6, False),  # a sheet of a few micrometres, in mm
        (5e-7, 0.0, False),
        (0.0, 0.0, True),
        (1e-13, 0.0, True),
        (1.0, None, False),
    ],
)
def test_what_is_proved_is_so_at_every_scale(travel, bound, proved):
    assert result(travel, bound).proved is proved
    assert ("optimal" in result(travel, bound).summary()) is proved


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_a_proof_does_not_depend_on_the_scale(scale):
    segments = scale * np.array([[[x, y], [x + 0.9, y + 0.2]] for x in range(3) for y in range(3)])
    proved = solve(segments, method="exact", first=None)
    assert proved.proved
    narrow = solve(segments, method="beam", effort="quick", first=None)
    assert narrow.proved == (narrow.cost == proved.cost)
    above = solve(segments, method="greedy", first=3)
    assert above.cost > 1.01 * proved.cost
    assert not above.proved


def test_a_method_has_a_bound_of_the_tree_unless_it_is_not_wanted():
    segments = np.array([[[x, y], [x + 0.9, y + 0.2]] for x in range(3) for y in range(3)])
    with_it, without = (solve(segments, method="greedy", bounded=wanted) for wanted in (True, False))
    assert 0.0 < with_it.lower_bound <= with_it.cost
    assert without.lower_bound is None
    assert (with_it.order == without.order).all()
