"""Window search: printable, never worse, and exact where one window holds everything."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import searched

from slicer import generate
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem
from slicer.sequence.construct.hill_climbing import greedy
from slicer.sequence.layered import windows
from slicer.sequence.layered.windows import window_search
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search


def travel(problem: Problem, oriented: np.ndarray) -> float:
    return problem.travel_mm(oriented >> 1, oriented & 1)


@settings(max_examples=80, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    length=st.integers(2, 20),
    free=st.booleans(),
    flipped=st.sampled_from([None, False, True]),
)
def test_printable_and_no_worse_with_the_start_kept(sheet, seed, length, free, flipped):
    segments = sheet(seed, 40)
    first = None if free else int(Problem.build(segments).starts[-1] >> 1)
    problem = Problem.build(segments, first=first, first_flipped=flipped)
    before = searched(greedy, problem).oriented
    copy = before.copy()
    after = window_search(Search(problem, effort="quick"), before, length=length)
    assert (before == copy).all()
    assert problem.refusal(after >> 1) is None
    assert after[0] in problem.starts
    assert travel(problem, after) <= travel(problem, before) + 1e-9


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), free=st.booleans())
def test_a_window_over_everything_finds_the_optimum(sheet, optimum, seed, free):
    problem = Problem.build(sheet(seed, 8), first=None if free else 0)
    before = searched(greedy, problem).oriented
    after = window_search(Search(problem), before, length=8)
    assert travel(problem, after) == pytest.approx(optimum(problem), abs=1e-9)


def test_improves_greedy_and_is_deterministic():
    problem = Problem.build(hatch(generate.random_walk(4, 4, seed=5)).segments, first=0)
    before = searched(greedy, problem).oriented
    after = window_search(Search(problem), before)
    assert travel(problem, after) < 0.8 * travel(problem, before)
    assert (window_search(Search(problem), before) == after).all()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_next_to_nothing(count):
    segments = np.array([[[0.0, k], [1.0, k]] for k in range(count)]).reshape(-1, 2, 2)
    problem = Problem.build(segments, first=None)
    oriented = (2 * np.arange(count)).astype(np.int32)
    assert len(window_search(Search(problem), oriented)) == count


@pytest.mark.parametrize(
    ("effort", "name", "ended"),
    [
        ("default", "time", True),
        ("quick", "time", True),
        ("high", "time", False),
        ("default", "straight", False),
    ],
)
def test_under_a_body_a_pass_that_takes_longer_than_it_saves_is_the_last(monkeypatch, effort, name, ended):
    segments = hatch(generate.random_walk(3, 3, seed=5)).segments
    problem = Problem.build(segments, body=NozzleBody.of(0.05, press_mm=0.05))
    before = searched(greedy, problem).oriented
    passes = []
    begins = windows._begins
    monkeypatch.setattr(windows, "_begins", lambda n, length: passes.append(length) or begins(n, length))
    for seconds in (0.0, 1.0):
        monkeypatch.setattr(windows, "SECONDS_UNDER_A_BODY", seconds)
        passes.append(0)
        objective = Objective(name, 0.2, (30.0, 50.0, 5.0), (500.0, 500.0, 50.0))
        window_search(Search(problem, objective=objective, effort=effort), before, length=20, thrifty=True)
    patient, hasty = passes[1 : passes.index(0, 1)], passes[passes.index(0, 1) + 1 :]
    assert len(patient) > 1
    assert (len(hasty) == 1) == ended
    assert ended or hasty == patient
