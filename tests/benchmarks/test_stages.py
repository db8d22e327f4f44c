"""The benchmark of the stages tells what each of them takes and leaves."""

from pathlib import Path

import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.problem import Objective

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_each_stage_is_told_with_what_it_leaves(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from stages import stages

    problem = Problem.build(hatch(random_walk(2, 2, seed=1)).segments)
    found, whole = stages(problem, Objective("straight"), "default")
    best = solve(problem)
    costs = [cost for _, cost in found.values()]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(best.cost)
    assert all(seconds >= 0.0 for seconds, _ in found.values())
    assert whole == f"{best.cost:.3f} mm, at least {best.cost:.3f}"
