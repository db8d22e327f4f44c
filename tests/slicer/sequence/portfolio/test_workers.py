"""Several processes: the same result every time, their own time limits, and Ctrl-C at any moment."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from slicer.errors import SequenceError
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.portfolio.workers import STRIDE, run_workers
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}
GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]


@pytest.mark.parametrize("method", METHODS)
def test_workers_find_the_best_of_their_seeds(method, reference):
    problem, _ = reference("2x2_s1")
    # Each objective with some of the methods: a process takes longer to start than to search.
    goal = GOALS[sorted(METHODS).index(method) % len(GOALS)]
    options = {"method": method, "effort": "quick", "objective": goal}
    alone = [solve(problem, **options, seed=seed) for seed in (3, 3 + STRIDE)]
    best = min(alone, key=lambda one: one.cost)
    both = solve(problem, **options, seed=3, workers=2)
    assert np.array_equal(both.order, best.order)
    assert np.array_equal(both.flipped, best.flipped)
    assert both.cost == best.cost
    assert both.objective == goal.name
    assert both.nodes_visited == sum(one.nodes_visited for one in alone)
    assert both.lower_bound_mm == best.lower_bound_mm
    assert not both.stopped


def test_a_time_limit_ends_workers_too(reference):
    problem, _ = reference("10x10_s1")
    goal = GOALS[2]
    greedy = solve(problem, method="greedy", objective=goal)
    options = {"method": "aco", "effort": "high", "objective": goal, "initial": greedy}
    begin = time.perf_counter()
    result = solve(problem, **options, workers=2, time_limit_s=1.5)
    assert time.perf_counter() - begin < 20  # the effort alone takes minutes
    assert result.stopped
    assert result.objective == "time"
    assert problem.refusal(result.order) is None
    assert result.cost <= greedy.cost


INTERRUPTED = """
import json, os, signal, sys, threading, time
import numpy as np
from slicer.sequence import Problem, solve

if __name__ == "__main__":
    instance = json.load(open(sys.argv[1]))
    problem = Problem.build(np.array(instance["segments"], float), first=instance["first"])
    start = solve(problem, method="greedy")
    solve(problem, method="aco", effort="quick", time_limit_s=0.1)  # an interrupt waits for what is being compiled
    for delay in map(float, sys.argv[2:]):
        given = start if delay < 1 else None
        timer = threading.Timer(delay, os.killpg, (0, signal.SIGINT))
        timer.start()
        begin = time.perf_counter()
        result = solve(problem, method="aco", effort="high", workers=2, initial=given)
        timer.join()
        refused = problem.refusal(result.order)
        better = result.travel_mm <= start.travel_mm
        print(json.dumps([delay, result.stopped, refused, better, time.perf_counter() - begin]), flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="process groups and signals of POSIX")
def test_ctrl_c_returns_a_sequence_at_any_moment(tmp_path):
    """A real SIGINT to the whole group: while processes start, while they import, and while they search.

    It is sent from another thread, as where the caller shows how things go.
    """
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    root = Path(__file__).parents[4]
    instance = root / "tests" / "data" / "reference" / "10x10_s1.json"
    delays = ["0.02", "0.1", "0.6", "1.2", "3"]
    done = subprocess.run(
        [sys.executable, script, instance, *delays],
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=300,
        start_new_session=True,
    )
    assert done.returncode == 0, done.stderr
    # Python tells of an interrupt inside a call-back of numba's compiler, and goes on.
    assert "Traceback" not in done.stderr or "llvmlite" in done.stderr
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(runs) == len(delays)
    for delay, stopped, refused, better, took in runs:
        assert stopped, delay
        assert refused is None, delay
        assert better, delay
        assert took < delay + 60, delay  # the effort alone takes minutes


class Fatal:
    """Ends the process that it is sent to."""

    def __reduce__(self):
        return os._exit, (1,)


def test_a_worker_that_is_killed_is_told_of():
    problem = Problem.build([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]])
    with pytest.raises(SequenceError, match="one of the 2 workers ended without an answer"):
        run_workers(Search(problem), print, Fatal(), 2)
