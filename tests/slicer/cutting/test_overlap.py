"""Pieces that reach over one another."""

import numpy as np
import pytest

from slicer.cutting import cut, less_pressed, overlapping
from slicer.cutting.hindering import hinders
from slicer.errors import SlicerError
from slicer.kernels import kernel
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem, solve

PAIR = np.array([[[0.0, 0.0], [0.1, 1.0]], [[0.3, 0.0], [0.4, 1.0]]])
BODY = NozzleBody.of(1.0, press_mm=0.1)


@kernel
def stands(body: NozzleBody, a: np.ndarray, b: np.ndarray) -> bool:
    return hinders(body, a, b)


def test_later_pieces_reach_over_earlier_ones_as_far_as_is_free():
    inner = less_pressed(BODY, 0.05)
    done = cut(PAIR, inner)
    order = solve(Problem.build(done.segments, body=inner)).order
    place = np.argsort(order)
    laid = overlapping(done, order, BODY, 0.05)
    longer = np.hypot(*(laid - done.segments).transpose(2, 0, 1))
    assert longer.max() == pytest.approx(0.05)
    for k in range(len(laid)):
        for end in range(2):
            if longer[k, end] == 0:
                continue
            other = k - 1 if end == 0 else k + 1
            assert done.toolpath[other] == done.toolpath[k]
            assert place[other] < place[k], "it is the later one that is lengthened"
            (ux, uy), (vx, vy) = (
                np.diff(PAIR[done.toolpath[k]], axis=0)[0],
                laid[k, end] - done.segments[k, end],
            )
            along = ux * vy - uy * vx
            assert along == pytest.approx(0, abs=1e-12)
            extra = np.array([done.segments[k, end], laid[k, end]])
            printed = [
                q for q in range(len(laid)) if place[q] < place[k] and done.toolpath[q] != done.toolpath[k]
            ]
            assert not any(stands(BODY, done.segments[q], extra) for q in printed)


def test_half_of_a_piece_stays_its_own_however_far_the_others_are_to_reach():
    inner = less_pressed(BODY, 0.09)
    done = cut(PAIR, inner)
    order = solve(Problem.build(done.segments, body=inner)).order
    laid = overlapping(done, order, BODY, 0.09)
    length = np.hypot(*(done.segments[:, 1] - done.segments[:, 0]).T)
    assert length.min() < 0.09, "some are shorter than the overlap"
    reached = np.hypot(*(laid - done.segments).transpose(2, 0, 1))
    assert reached.max() > 0.01
    assert (reached[1:, 0] <= length[:-1] / 2 + 1e-9).all()
    assert (reached[:-1, 1] <= length[1:] / 2 + 1e-9).all()


def test_no_more_overlap_than_can_be_pressed():
    with pytest.raises(SlicerError, match="below press_mm, 0.1"):
        less_pressed(BODY, 0.1)


def test_pieces_meet_where_nothing_is_said():
    done = cut(PAIR, BODY)
    order = solve(Problem.build(done.segments, body=BODY)).order
    assert np.array_equal(overlapping(done, order, BODY, 0.0), done.segments)
