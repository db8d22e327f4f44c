"""The covering relation against its definition."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from fields import closure, loose_segments, random_extension, relation, segment_sets
from hypothesis import given, settings

from slicer.errors import CrossingError, SlicerError
from slicer.precedence import columns, covering_edges, violations

REFERENCE = Path(__file__).parents[1] / "data" / "reference"
SCORER = Path(__file__).parents[3] / "shared" / "reference" / "score.py"


def matrix(n, edges):
    out = np.zeros((n, n), bool)
    out[edges[:, 0], edges[:, 1]] = True
    return out


def reduction(order):
    """The covering pairs of a transitive relation."""
    return order & ~((order.astype(int) @ order.astype(int)) > 0)


@settings(max_examples=300, deadline=None)
@given(segment_sets() | loose_segments())
def test_edges_are_exactly_the_covering_relation(segments):
    order = closure(relation(segments))
    assert not order.diagonal().any(), "the relation has a cycle"
    edges = covering_edges(segments)
    np.testing.assert_array_equal(matrix(len(segments), edges), reduction(order))
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert len(edges) <= 3 * len(segments)


@pytest.mark.parametrize("name", ["2x2_s1", "3x3_s1", "4x4_s1", "6x6_s1"])
def test_reference_instances_against_the_independent_scorer(name):
    if not SCORER.exists():
        pytest.skip("the independent scorer is not beside this checkout")
    spec = importlib.util.spec_from_file_location("score", SCORER)
    score = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(score)
    segments = np.array(json.loads((REFERENCE / f"{name}.json").read_text())["segments"])
    order = closure(score.below(segments.copy()))
    np.testing.assert_array_equal(closure(matrix(len(segments), covering_edges(segments))), order)


@settings(max_examples=100, deadline=None)
@given(segment_sets() | loose_segments())
def test_columns_are_the_components_of_overlapping_x_ranges(segments):
    column = columns(segments)
    n = len(segments)
    related = relation(segments)
    for a in range(n):
        for b in range(n):
            if related[a, b]:
                assert column[a] == column[b]
    x = segments[:, :, 0]
    ordered = np.argsort(column, kind="stable")
    for left, right in zip(ordered, ordered[1:], strict=False):
        if column[left] != column[right]:
            assert x[column == column[left]].max() <= x[right].min() + 1e-9


def test_neighbouring_columns_do_not_constrain_each_other():
    left = [[0.0, 0.0], [1.0, 0.0]]
    right = [[1.0, 5.0], [2.0, 5.0]]
    assert len(covering_edges([left, right])) == 0
    assert columns([left, right]).tolist() == [0, 1]


def test_a_vertical_is_tied_to_what_passes_above_and_below_it():
    floor, roof = [[0.0, 0.0], [2.0, 0.0]], [[0.0, 3.0], [2.0, 3.0]]
    upright = [[1.0, 1.0], [1.0, 2.0]]
    assert covering_edges([roof, upright, floor]).tolist() == [[1, 0], [2, 1]]


def test_a_vertical_at_the_end_of_a_line_is_free():
    upright = [[2.0, 1.0], [2.0, 2.0]]
    assert len(covering_edges([[[0.0, 0.0], [2.0, 0.0]], upright])) == 0


def test_a_pair_that_other_pairs_imply_is_left_out():
    low, high = [[0.0, 0.0], [3.0, 0.0]], [[0.0, 2.0], [3.0, 2.0]]
    between = [[1.0, 1.0], [2.0, 1.0]]
    assert covering_edges([low, between, high]).tolist() == [[0, 1], [1, 2]]


@pytest.mark.parametrize(
    "pair",
    [
        [[[0.0, 0.0], [1.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]],
        [[[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [3.0, 0.0]]],
        [[[0.0, 0.0], [2.0, 0.0]], [[1.0, -1.0], [1.0, 1.0]]],
        [[[0.0, 0.0], [0.0, 2.0]], [[0.0, 1.0], [0.0, 3.0]]],
        [[[0.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0]]],
    ],
    ids=["cross", "overlap", "upright through level", "uprights overlap", "same"],
)
def test_lines_that_cross_or_overlap_are_named(pair):
    apart = [[5.0, 0.0], [6.0, 1.0]]
    with pytest.raises(CrossingError, match="toolpath 1 .* crosses or overlaps toolpath 2") as caught:
        covering_edges([apart, *pair])
    assert sorted(caught.value.pair) == [1, 2]


def test_lines_that_touch_do_not_cross():
    tent = [[[0.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [2.0, 0.0]], [[0.0, 0.0], [1.0, -1.0]]]
    assert covering_edges(tent).tolist() == [[2, 0]]


def test_a_coordinate_must_be_finite():
    with pytest.raises(SlicerError, match="toolpath 1"):
        covering_edges([[[0.0, 0.0], [1.0, 1.0]], [[0.0, np.nan], [1.0, 0.0]]])


def test_no_toolpaths():
    assert covering_edges(np.empty((0, 2, 2))).shape == (0, 2)
    assert columns(np.empty((0, 2, 2))).shape == (0,)


@settings(max_examples=50, deadline=None)
@given(segment_sets(max_n=30))
def test_violations_names_exactly_the_broken_pairs(segments):
    n = len(segments)
    edges = covering_edges(segments)
    random = np.random.default_rng(n)
    assert len(violations(random_extension(random, n, edges), edges)) == 0
    shuffled = random.permutation(n)
    position = np.argsort(shuffled)
    broken = [k for k, (a, b) in enumerate(edges) if position[a] > position[b]]
    assert violations(shuffled, edges).tolist() == broken
