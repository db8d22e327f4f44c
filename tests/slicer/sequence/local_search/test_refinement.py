"""Windows of a sequence cost what they do in it, with a body too."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies
from calling import from_python
from fields import random_extension
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import skyline
from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.nozzle import POINT
from slicer.sequence.local_search import refinement
from slicer.sequence.local_search.refinement import refine
from slicer.sequence.local_search.start import tour_of
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.search import Search
from slicer.sequence.problem.sequence_cost import true_cost
from slicer.skyline import new_skyline, skyline_with_room

ROUTED = Objective("routed", 0.2)
price, with_laid = from_python(refinement._price), from_python(skyline.with_laid)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), body=st.just(POINT) | bodies(), data=st.data())
def test_a_window_is_priced_as_the_objective_counts_it(sheet, seed, body, data):
    problem = replace(Problem.build(sheet(seed, 30, 3)), body=body)
    order = random_extension(np.random.default_rng(seed), problem.n, problem.edges)
    oriented = (2 * order + (order + seed) % 2).astype(np.int32)
    low = data.draw(st.integers(1, problem.n))
    high = data.draw(st.integers(low, problem.n))
    tour = tour_of(Search(problem, objective=ROUTED), oriented)
    sky = new_skyline(problem.segments, body, 0)
    for u in oriented[: max(0, low - 2)]:
        sky = with_laid(sky, problem.segments[u >> 1], -1)
    copy = skyline_with_room(4000, body, sky.floor)
    counted = [true_cost(problem, ROUTED, oriented[:k]) for k in (low - 1, high) if k] or [0.0]
    expected = counted[-1] - (counted[0] if low > 1 else 0.0)
    assert price(tour, sky, copy, low, high) == pytest.approx(expected, abs=1e-7)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), body=st.just(POINT) | bodies())
def test_what_comes_back_is_printable_and_costs_less(seed, body):
    segments = hatch(random_walk(4, 4, seed=seed)).segments  # several windows
    problem = replace(Problem.build(segments), body=body)
    order = random_extension(np.random.default_rng(seed), problem.n, problem.edges)
    refined = refine(Search(problem, objective=ROUTED, effort="quick"), (2 * order).astype(np.int32))
    assert problem.refusal(refined >> 1) is None
    assert true_cost(problem, ROUTED, refined) < true_cost(problem, ROUTED, (2 * order).astype(np.int32))
