"""``beam`` gives printable sequences, never worse than what it was given."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import searched

from slicer import generate
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.construct.hill_climbing import greedy
from slicer.sequence.layered.beam_search import beam


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), free=st.booleans(), effort=st.sampled_from(["quick", "default"]))
def test_printable_and_no_worse_than_its_start(sheet, seed, free, effort):
    segments = sheet(seed, 60)
    problem = Problem.build(segments, first=None if free else 0)
    initial = searched(greedy, problem).oriented
    found = searched(beam, problem, effort=effort, initial=initial)
    travel = problem.travel_mm(found.oriented >> 1, found.oriented & 1)
    assert problem.refusal(found.oriented >> 1) is None
    assert found.oriented[0] in problem.starts
    assert travel <= problem.travel_mm(initial >> 1, initial & 1)


def test_a_corridor_improves_on_its_start_and_proves_no_more_than_is_true(monkeypatch):
    problem = Problem.build(hatch(generate.random_walk(4, 4, seed=3)).segments, first=0)
    initial = searched(greedy, problem).oriented
    monkeypatch.setattr("slicer.sequence.layered.beam_search.ARCS_PER_TOOLPATH", {"default": 700})
    found = searched(beam, problem, initial=initial)
    assert problem.refusal(found.oriented >> 1) is None
    assert 0.0 < found.lower_bound <= solve(problem, method="exact").travel_mm + 1e-9
    travel = problem.travel_mm(found.oriented >> 1, found.oriented & 1)
    assert travel < 0.95 * problem.travel_mm(initial >> 1, initial & 1)


def test_close_to_the_optimum_of_a_sheet_of_the_paper():
    problem = Problem.build(hatch(generate.random_walk(5, 5, seed=4)).segments, first=0)
    best = solve(problem, method="exact")
    assert best.proved
    result = solve(problem, method="beam")
    assert best.travel_mm - 1e-9 <= result.travel_mm <= 1.01 * best.travel_mm
    assert result.lower_bound_mm == pytest.approx(best.travel_mm, rel=0.05)
