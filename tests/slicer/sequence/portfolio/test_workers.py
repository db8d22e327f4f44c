"""Several processes: the same result every time, one time limit for all, and Ctrl-C at any moment."""

import contextlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from slow_searches import fail_second, lose_second, wait_for_ever

from slicer.errors import SequenceError, SequenceWarning
from slicer.sequence import METHODS, Problem, solve
from slicer.sequence.construct import multistart
from slicer.sequence.portfolio import capacity
from slicer.sequence.portfolio.workers import STRIDE, run_workers
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.search import Search

MACHINE = {"clearance_mm": 0.2, "speed_mm_s": (30.0, 50.0, 5.0), "acceleration_mm_s2": (500.0, 500.0, 50.0)}


@pytest.fixture(autouse=True)
def enough_cores(monkeypatch):
    """Let two workers run on whatever machine the tests do."""
    monkeypatch.setattr(capacity, "usable_cores", lambda: 2)


GOALS = [Objective(), Objective("routed", **MACHINE), Objective("time", **MACHINE)]


@pytest.mark.parametrize("method", METHODS)
def test_workers_find_the_best_of_their_seeds(method, reference, recwarn):
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
    assert not recwarn.list
    assert not both.stopped


def test_a_time_limit_ends_workers_that_do_not_look_at_it(reference):
    problem, _ = reference("2x2_s1")
    told = []
    search = Search(problem, progress=told.append)
    search.deadline = time.perf_counter() + 12.0
    begin = time.perf_counter()
    run_workers(search, wait_for_ever, "none", 2)
    assert time.perf_counter() - begin < 100  # far above the limit; without it this would never end
    assert search.stopped
    expected = Search(problem)
    multistart(expected)
    assert search.cost == expected.cost, "what a worker has told is lost when it is ended"
    assert [one.stage for one in told] == ["starts", "starts"]
    assert not multiprocessing.active_children()


def test_a_time_limit_ends_a_search_of_workers(reference):
    problem, _ = reference("10x10_s1")
    goal = GOALS[2]
    greedy = solve(problem, method="greedy", objective=goal)
    options = {"method": "aco", "effort": "high", "objective": goal, "initial": greedy}
    result = solve(problem, **options, workers=2, time_limit_s=1.5)
    assert result.stopped  # the effort alone takes minutes
    assert result.objective == "time"
    assert problem.refusal(result.order) is None
    assert result.cost <= greedy.cost


def test_one_worker_that_is_lost_costs_not_the_answers_of_the_others(reference):
    problem, _ = reference("2x2_s1")
    search = Search(problem)
    with pytest.warns(SequenceWarning, match="1 of the 2 workers ended without an answer"):
        run_workers(search, lose_second, "none", 2)
    expected = Search(problem)
    multistart(expected)
    assert search.cost == expected.cost
    assert search.stopped


def test_a_defect_in_a_worker_is_raised_with_its_place(reference):
    problem, _ = reference("2x2_s1")
    with pytest.raises(RuntimeError, match=r"(?s)in fail_second.*of the second"):
        run_workers(Search(problem), fail_second, "none", 2)


INTERRUPTED = """
import json, os, signal, sys, threading, time
import numpy as np
from slicer.sequence import Problem, solve

if __name__ == "__main__":
    instance = json.load(open(sys.argv[1]))
    problem = Problem.build(np.array(instance["segments"], float), first=instance["first"])
    start = solve(problem, method="greedy")
    # An interrupt while something is compiled comes late, or is lost: all of it beforehand, on a part of the sheet.
    part = Problem.build(problem.segments[np.sort(start.order[:40])])
    for workers in (1, 2):
        solve(part, method="aco", effort="quick", workers=workers)
    solve(problem, method="aco", effort="quick", time_limit_s=0.1)
    # The very call that is interrupted, with a sequence to begin with and tours to be merged in the end.
    solve(problem, method="aco", effort="high", workers=2, initial=start, time_limit_s=3.0)
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
    assert "Traceback" not in done.stderr or "llvmlite" in done.stderr, done.stderr
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(runs) == len(delays)
    for delay, stopped, refused, better, took in runs:
        assert stopped, (delay, done.stderr)
        assert refused is None, delay
        assert better, delay
        assert took < delay + 60, delay  # the effort alone takes minutes


class Fatal:
    """Ends the process that it is sent to."""

    def __reduce__(self):
        return os._exit, (1,)


def test_workers_that_are_all_killed_are_told_of():
    problem = Problem.build([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]])
    with pytest.raises(SequenceError, match="2 of the 2 workers ended without an answer"):
        run_workers(Search(problem), print, Fatal(), 2)


KILLED = """
import time
from slicer.sequence import Problem
from slicer.sequence.portfolio import capacity
from slicer.sequence.portfolio.workers import run_workers
from slicer.sequence.problem import Search

def search_for_ever(search, method):
    # Tells nothing, so that it does not learn from its pipe that nobody listens any more.
    while True:
        time.sleep(1.0)

if __name__ == "__main__":
    capacity.usable_cores = lambda: 2
    problem = Problem.build([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]])
    print("begun", flush=True)
    run_workers(Search(problem), search_for_ever, "none", 2)
"""


def children_of(pid: int) -> list[int]:
    """Processes whose parent is this one; proc(5)."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(stat.read_text().rsplit(")", 1)[1].split()[1]) == pid:
                found.append(int(stat.parent.name))
    return found


def until(true, what: str) -> None:
    """Wait for it, with a deadline so that a failing test ends."""
    ends = time.monotonic() + 60
    while not true():
        assert time.monotonic() < ends, what
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are read from /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_no_worker_outlives_its_parent(how, tmp_path):
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[4])}
    with subprocess.Popen([sys.executable, script], env=environment, stdout=subprocess.PIPE) as parent:
        assert parent.stdout.readline() == b"begun\n"
        until(lambda: len(children_of(parent.pid)) == 3, "two workers and the tracker of resources begin")
        workers = children_of(parent.pid)
        try:
            parent.send_signal(how)
            parent.wait()
            until(lambda: not any(map(alive, workers)), f"a worker outlives its parent: {workers}")
        finally:
            for worker in filter(alive, workers):
                os.kill(worker, signal.SIGKILL)


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and was not waited for does not."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False
