"""Hill climbing: the paper's rule, its counts and its table."""

import json
from pathlib import Path

import numpy as np
import pytest
from fields import segment_sets
from hypothesis import assume, given, settings

from slicer.errors import SequenceError
from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.precedence import covering_edges
from slicer.sequence import Problem, solve

REFERENCE = Path(__file__).parents[3] / "data" / "reference"
KNOWN = json.loads((REFERENCE / "reference.json").read_text())["greedy"]
PAPER = {2: (52, 224, 8.340), 4: (200, 1206, 33.644)}
"""Table 1 of the source paper: nodes visited, states created, J."""


def hill_climb(segments, start):
    """The rule, step by step: nearest endpoint of a printable toolpath, first in numbering on a tie."""
    n = len(segments)
    edges = covering_edges(segments)
    todo, sequence, states = set(range(n)), [start], 0
    todo.remove(start >> 1)
    while True:
        ready = [s for s in todo if not any(a in todo for a, b in edges if b == s)]
        states += 2 * len(ready)
        if not ready:
            return sequence, states
        nozzle = segments[sequence[-1] >> 1, 1 - (sequence[-1] & 1)]
        options = [(((segments[s, f] - nozzle) ** 2).sum(), 2 * s + f) for s in ready for f in (0, 1)]
        sequence.append(min(options)[1])
        todo.remove(sequence[-1] >> 1)


@settings(max_examples=100, deadline=None)
@given(segment_sets(max_n=40))
def test_it_goes_to_the_nearest_printable_endpoint(segments):
    assume(len(segments))
    problem = Problem.build(segments)
    start = int(problem.starts[-1])
    result = solve(segments, first=start >> 1, first_flipped=bool(start & 1), method="greedy")
    sequence, states = hill_climb(segments, start)
    # On a tie two sequences are right; the length of each step tells.
    expected = problem.travel_mm(np.array(sequence) >> 1, np.array(sequence) & 1)
    assert result.travel_mm == pytest.approx(expected)
    assert result.states_created == states
    assert result.nodes_visited == len(segments)
    assert problem.refusal(result.order) is None


@pytest.mark.parametrize("name", ["2x2_s1", "3x3_s1", "4x4_s1", "6x6_s1", "10x10_s1"])
def test_reference_instances(name):
    segments = np.array(json.loads((REFERENCE / f"{name}.json").read_text())["segments"])
    result = solve(segments, method="greedy")
    assert result.travel_mm == pytest.approx(KNOWN[name], abs=0.01)
    assert Problem.build(segments, first=0).refusal(result.order) is None


@pytest.mark.parametrize("tiles", PAPER)
def test_the_papers_table_lies_within_our_distribution(tiles):
    figures = []
    for seed in range(500):
        segments = hatch(random_walk(tiles, tiles, seed=seed)).segments
        lower_end = bool(segments[0, 1, 1] < segments[0, 0, 1])
        result = solve(segments, first=0, first_flipped=lower_end, method="greedy")
        figures.append((result.nodes_visited, result.states_created, result.travel_mm))
    low, high = np.percentile(figures, [1, 99], axis=0)
    for name, figure, a, b in zip(("nodes", "states", "J"), PAPER[tiles], low, high, strict=True):
        assert a <= figure <= b, f"{name}: the paper's {figure} is outside [{a:.3f}, {b:.3f}]"


@settings(max_examples=30, deadline=None)
@given(segment_sets(max_n=15))
def test_a_free_start_is_the_best_of_all_starts(segments):
    assume(len(segments))
    problem = Problem.build(segments)
    each = [
        solve(segments, first=int(u) >> 1, first_flipped=bool(u & 1), method="greedy").travel_mm
        for u in problem.starts
    ]
    assert solve(segments, first=None, method="greedy").travel_mm == pytest.approx(min(each))


def test_nothing_and_one():
    assert solve(np.empty((0, 2, 2)), method="greedy").order.tolist() == []
    one = solve([[[0.0, 0.0], [1.0, 0.0]]], method="greedy")
    assert (one.order.tolist(), one.travel_mm, one.nodes_visited, one.states_created) == ([0], 0.0, 1, 0)


def test_a_wide_antichain_is_walked_along():
    n = 2000
    x = np.arange(n, dtype=float)
    segments = np.stack([np.stack([x, x * 0], 1), np.stack([x + 0.5, x * 0 + 1], 1)], axis=1)
    assert solve(segments, first=0, first_flipped=False, method="greedy").order.tolist() == list(range(n))


def test_what_cannot_come_first_is_refused():
    with pytest.raises(SequenceError, match="toolpath 0 lies above toolpath 1"):
        solve([[[0.0, 1.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 0.0]]], first=0)
    with pytest.raises(SequenceError, match="there are 1"):
        solve([[[0.0, 1.0], [1.0, 1.0]]], first=3)
    with pytest.raises(SequenceError, match="no method 'gredy'"):
        solve([[[0.0, 1.0], [1.0, 1.0]]], method="gredy")
    with pytest.raises(SequenceError, match=r"shape \(1, 2\)"):
        solve([[0.0, 1.0]])


def test_refusal_says_what_is_wrong():
    problem = Problem.build([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]], first=0)
    assert problem.refusal([0, 1]) is None
    assert "exactly once" in problem.refusal([0, 0])
    assert "begins with toolpath 1" in problem.refusal([1, 0])
    free = Problem.build(problem.segments)
    assert "toolpath 0 lies below 1 but comes after" in free.refusal([1, 0])
