"""Several processes at once, each with a seed of its own; what they find is spliced."""

import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

from slicer.sequence.descend import RELATIVE_EPS
from slicer.sequence.method import Found, Options
from slicer.sequence.problem import Problem
from slicer.sequence.splice import splice
from slicer.sequence.true_cost import true_cost

Search = Callable[[Problem, str, Options], Found]

STRIDE = 1_000_003
"""Between the seeds of two workers, so that runs with neighbouring seeds share none."""


def run_workers(problem: Problem, search: Search, method: str, options: Options, workers: int) -> Found:
    """Run ``search`` with ``workers`` seeds, and keep the best bound and the cheapest sequence.

    That is one of theirs or the best crossing of them.

    Ctrl-C reaches every process of a terminal: each returns what it has.
    """
    left = None if options.deadline is None else options.deadline - time.perf_counter()
    plain = replace(options, deadline=None, progress=None)
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        runs = [
            pool.submit(_run, problem, search, method, replace(plain, seed=options.seed + STRIDE * k), left)
            for k in range(workers)
        ]
        try:
            found = [run.result() for run in runs]
        except KeyboardInterrupt:
            found = [run.result() for run in runs]
    bounds = [one.lower_bound_mm for one in found if one.lower_bound_mm is not None]
    sequences = [one.oriented for one in found]
    costs = [true_cost(problem, options.objective, oriented) for oriented in sequences]
    best = sequences[costs.index(min(costs))]
    if min(costs) > max(bounds, default=0.0) * (1 + RELATIVE_EPS):
        spliced = splice(problem, options.objective, sequences)
        if true_cost(problem, options.objective, spliced) < min(costs):
            best = spliced
    return Found(
        best,
        nodes_visited=sum(one.nodes_visited for one in found),
        states_created=sum(one.states_created for one in found),
        lower_bound_mm=max(bounds, default=None),
        stopped=any(one.stopped for one in found),
    )


def _run(problem: Problem, search: Search, method: str, options: Options, left: float | None) -> Found:
    """In the worker: its clock need not be the caller's, so that the time left is handed over."""
    deadline = None if left is None else time.perf_counter() + left
    return search(problem, method, replace(options, deadline=deadline))
