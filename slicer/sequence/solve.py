"""The public call of the sequencer: segments in, a ``Result`` out."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import SequenceError
from slicer.sequence.construct import first_hill_climb, greedy, multistart
from slicer.sequence.layered import beam, exact
from slicer.sequence.local_search import local
from slicer.sequence.portfolio import CARRY_UP_TO, WINDOWS_UP_TO, auto, run_workers, search_by_surrogates
from slicer.sequence.problem import (
    EFFORTS,
    Found,
    Method,
    Objective,
    ObjectiveName,
    Options,
    Problem,
    Progress,
    Result,
    directed,
    real_number,
    true_cost,
    whole_number,
)
from slicer.sequence.tree_search import aco, mcts

METHODS: dict[str, Method] = {
    "auto": auto,
    "greedy": greedy,
    "multistart": multistart,
    "local": local,
    "beam": beam,
    "exact": exact,
    "mcts": mcts,
    "aco": aco,
}

RELATIVE_EPS = 1e-9

Initial = ArrayLike | tuple[ArrayLike, ArrayLike] | Result


def solve(
    segments: ArrayLike | Problem,
    *,
    first: int | None = 0,
    first_flipped: bool | None = None,
    method: str = "auto",
    effort: str = "default",
    time_limit_s: float | None = None,
    seed: int = 0,
    initial: Initial | None = None,
    objective: ObjectiveName | Objective = "straight",
    progress: Callable[[Progress], None] | None = None,
    workers: int = 1,
) -> Result:
    """Order and orient toolpaths so that the nozzle travels little between them.

    The same arguments give the same result, unless a time limit or Ctrl-C ends the search early; the best
    sequence so far is returned then, and ``Result.stopped`` says so.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm; or a ``Problem``, whose own start then holds.
        first: index of the toolpath to begin with; None leaves the start free.
        first_flipped: whether the first toolpath is printed from its second endpoint; None leaves its
            direction free.
        method: one of ``METHODS``.
        effort: "quick", "default" or "high": how many iterations are spent.
        time_limit_s: ends the search early, or not at all where None is given.
        seed: for methods that draw random numbers.
        initial: an order, int (n,), or an order and its directions, bool (n,), or a ``Result``. What is
            returned is never worse.
        objective: what counts: "straight", "routed" or "time", or an ``Objective`` with the limits of a
            machine.
        progress: called now and then with the cost of the best sequence so far. With several workers it
            is not called.
        workers: processes, each with a seed of its own; the best result is kept.

    Raises:
        CrossingError: two toolpaths cross or overlap.
        SequenceError: no such method, effort or objective; ``first`` cannot be printed first; ``initial``
            cannot be printed; fewer than one worker; a negative time limit.
    """
    begin = time.perf_counter()
    goal = _goal(objective)
    _check(method, effort, time_limit_s, workers)
    problem = (
        segments
        if isinstance(segments, Problem)
        else Problem.build(segments, first=first, first_flipped=first_flipped)
    )
    given = None if initial is None else _given(problem, initial, goal)
    options = Options(
        effort=effort,
        seed=seed,
        objective=goal,
        deadline=None if time_limit_s is None else begin + float(time_limit_s),
        initial=given,
        progress=progress,
    )
    if workers > 1 and problem.n > 1:
        found = run_workers(problem, _search, method, options, workers)
    else:
        found = _search(problem, method, options)
    order, flipped = (found.oriented >> 1).astype(np.int64), (found.oriented & 1).astype(np.bool_)
    refused = problem.refusal(order) if problem.n else None
    if refused is not None:
        raise AssertionError(f"method {method} returned an order that cannot be printed: {refused}")
    travel = problem.travel_mm(order, flipped)
    bound = 0.0 if problem.n < 2 else found.lower_bound_mm
    if bound is not None and bound > travel * (1 + RELATIVE_EPS):
        raise AssertionError(
            f"method {method} claims that no travel is below {bound} mm, but found {travel} mm"
        )
    return Result(
        order=order,
        flipped=flipped,
        travel_mm=travel,
        lower_bound_mm=None if bound is None else min(bound, travel),
        nodes_visited=found.nodes_visited,
        states_created=found.states_created,
        method=method,
        seed=options.seed,
        runtime_s=time.perf_counter() - begin,
        objective=goal.name,
        cost=true_cost(problem, goal, found.oriented),
        stopped=found.stopped,
    )


def _search(problem: Problem, method: str, options: Options) -> Found:
    """Run a method, see that nothing worse than ``options.initial`` comes back, and tell how it ended.

    Ctrl-C before a method has anything gives the initial sequence, or one that greedy finds.
    """
    try:
        if options.objective.routed and problem.n > 1:
            carrying = _carrying_skyline(method, problem.n, options.effort)
            found = search_by_surrogates(
                problem,
                METHODS[method],
                None if carrying is None else METHODS[carrying],
                options,
                refined=method not in ("greedy", "multistart"),
                windows=method == "auto" and carrying is None and problem.n <= WINDOWS_UP_TO,
            )
        else:
            found = METHODS[method](problem, options)
    except KeyboardInterrupt:
        start = options.initial
        found = Found(first_hill_climb(problem, options) if start is None else start, stopped=True)
    found = _at_least_initial(problem, found, options)
    if options.progress is not None:
        bound = None if options.objective.routed else found.lower_bound_mm
        cost = true_cost(problem, options.objective, found.oriented)
        try:
            options.progress(Progress("end", cost, bound, found.oriented))
        except KeyboardInterrupt:
            return replace(found, stopped=True)
    return found


def _carrying_skyline(method: str, n: int, effort: str) -> str | None:
    """The method over down-sets that goes with this one, if the sheet is small enough for it."""
    if method in ("exact", "beam"):
        return method
    return "exact" if method == "auto" and n <= CARRY_UP_TO[effort] else None


def _at_least_initial(problem: Problem, found: Found, options: Options) -> Found:
    """What was found, or the initial sequence where that is cheaper after all."""
    start = options.initial
    if start is None or true_cost(problem, options.objective, found.oriented) <= true_cost(
        problem, options.objective, start
    ):
        return found
    return replace(found, oriented=start)


def _goal(objective: ObjectiveName | Objective) -> Objective:
    return objective if isinstance(objective, Objective) else Objective(objective)


def _check(method: str, effort: str, time_limit_s: float | None, workers: int) -> None:
    """Refuse what is not worth beginning; ``Options`` looks at the seed."""
    if not isinstance(method, str) or method not in METHODS:
        raise SequenceError(f"there is no method '{method}'; there are {', '.join(METHODS)}")
    if not isinstance(effort, str) or effort not in EFFORTS:
        raise SequenceError(f"there is no effort '{effort}'; there are {', '.join(EFFORTS)}")
    if time_limit_s is not None:
        real_number("time_limit_s", time_limit_s, "Give seconds, or None for no limit.", 0.0, np.inf)
    whole_number("workers", workers, "Give the number of processes, 1 for this one alone.", 1)


def _given(problem: Problem, initial: Initial, objective: Objective) -> NDArray[np.int32]:
    """The initial sequence as oriented toolpaths, int32 (n,), if it can be printed."""
    flips: ArrayLike | None = None
    if isinstance(initial, Result):
        order, flips = initial.order, initial.flipped
    elif isinstance(initial, tuple) and len(initial) == 2 and np.ndim(initial[0]) == 1:
        order, flips = np.asarray(initial[0]), initial[1]
    else:
        order = np.asarray(initial)
    if problem.n == 0 and order.size == 0:
        return np.empty(0, np.int32)
    if order.shape != (problem.n,) or not np.issubdtype(order.dtype, np.integer):
        raise SequenceError(
            f"the initial order has shape {order.shape} and type {order.dtype}, but must hold "
            f"{problem.n} whole numbers"
        )
    refused = problem.refusal(order)
    if refused is not None:
        raise SequenceError(f"the initial order cannot be printed: {refused}")
    if flips is None:
        # The best directions for direct travels need not be the best over the skyline.
        fixed = problem.first_flipped
        ways = [directed(problem, order, objective)]
        ways += [(2 * order + flip).astype(np.int32) for flip in (0, 1) if fixed in (None, bool(flip))]
        return min(ways, key=lambda oriented: true_cost(problem, objective, oriented))
    flipped = np.asarray(flips)
    if flipped.shape != order.shape:
        raise SequenceError(f"the initial directions have shape {flipped.shape}, but must have {order.shape}")
    if problem.first_flipped is not None and bool(flipped[0]) != problem.first_flipped:
        raise SequenceError("the initial sequence begins in the other direction than the first toolpath must")
    oriented: NDArray[np.int32] = (2 * order + flipped.astype(bool)).astype(np.int32)
    return oriented
