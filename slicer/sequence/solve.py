"""The public call of the sequencer: segments in, a ``Result`` out."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import SequenceError
from slicer.sequence.bound import raise_cheap_bound
from slicer.sequence.construct import greedy, multistart, start_greedily
from slicer.sequence.layered import beam, exact
from slicer.sequence.local_search import local
from slicer.sequence.portfolio import (
    CARRY_AGAIN_UP_TO,
    WINDOWS_UP_TO,
    auto,
    run_workers,
    search_by_surrogates,
)
from slicer.sequence.problem import (
    EFFORTS,
    Method,
    Objective,
    ObjectiveName,
    Problem,
    Progress,
    Result,
    Search,
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
    bounded: bool = True,
) -> Result:
    """Order and orient toolpaths so that the nozzle travels little between them.

    The same arguments give the same result, unless a time limit or Ctrl-C ends the search early; the best
    sequence so far is returned then, and ``Result.stopped`` says so.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm, for a nozzle that is a point; or a ``Problem``, whose
            own nozzle, directions and start then hold.
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
        progress: called now and then with the cost of the best sequence so far.
        workers: processes, each with a seed of its own; the best result is kept. No more run than the machine
            has cores and free memory for, and a ``SequenceWarning`` says so; see ``allowed_workers``.
        bounded: whether a method that has no lower bound of its own is given one, which takes time.

    Raises:
        CrossingError: two toolpaths cross or overlap.
        SequenceError: no such method, effort or objective; ``first`` cannot be printed first; ``initial``
            cannot be printed, in its order or its directions; fewer than one worker; a negative time limit.
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
    search = Search(
        problem,
        objective=goal,
        effort=effort,
        seed=seed,
        deadline=None if time_limit_s is None else begin + float(time_limit_s),
        initial=given,
        progress=progress,
    )
    if problem.n == 0:
        search.offer(np.empty(0, np.int32))
    elif workers > 1 and problem.n > 1:
        run_workers(search, partial(_search, bounded=bounded), method, workers)
    else:
        _search(search, method, bounded=bounded)
    return _result(search, method, time.perf_counter() - begin)


def _result(search: Search, method: str, runtime_s: float) -> Result:
    """What the search has come to, once it is seen that it can be printed and contradicts no bound."""
    problem, goal = search.problem, search.objective
    order, flipped = (search.oriented >> 1).astype(np.int64), (search.oriented & 1).astype(np.bool_)
    refused = problem.refusal(order, flipped)
    if refused is not None:
        raise AssertionError(f"method {method} returned a sequence that cannot be printed: {refused}")
    travel = problem.travel_mm(order, flipped)
    bound = _known(search.lower_bound, search.cost, goal.unit, method)
    straight = _known(search.straight_bound_mm, travel, "mm", method)
    return Result(
        order=order,
        flipped=flipped,
        travel_mm=travel,
        lower_bound_mm=0.0 if problem.n < 2 else straight,
        nodes_visited=search.nodes_visited,
        states_created=search.states_created,
        method=method,
        seed=search.seed,
        runtime_s=runtime_s,
        objective=goal.name,
        unit=goal.unit,
        cost=search.cost,
        lower_bound=0.0 if problem.n < 2 else bound,
        stopped=search.stopped,
    )


def _known(bound: float, cost: float, unit: str, method: str) -> float | None:
    """A bound that is no dearer than what was found; None where nothing is known."""
    if bound > cost * (1 + RELATIVE_EPS):
        raise AssertionError(f"method {method} claims that nothing is below {bound} {unit}, but found {cost}")
    return min(bound, cost) if bound > 0.0 or cost == 0.0 else None


def _search(search: Search, method: str, *, bounded: bool) -> None:
    """Run a method and tell how it ended; Ctrl-C ends it with the best so far, or with greedy's sequence."""
    try:
        if search.objective.routed and search.problem.n > 1:
            carrying = _carrying_skyline(method, search.problem.n, search.effort)
            search_by_surrogates(
                search,
                METHODS[method],
                None if carrying is None else METHODS[carrying],
                refined=method not in ("greedy", "multistart"),
                windows=method == "auto" and carrying is None and search.problem.n <= WINDOWS_UP_TO,
                enumerating=method == "auto",
            )
        else:
            METHODS[method](search)
    except KeyboardInterrupt:
        search.stopped = True
        if not search.started:
            start_greedily(search)
    try:
        if bounded:
            raise_cheap_bound(search)
        search.report("end")
    except KeyboardInterrupt:
        search.stopped = True


def _carrying_skyline(method: str, n: int, effort: str) -> str | None:
    """The method over down-sets that goes with this one, if the sheet is small enough for it."""
    if method in ("exact", "beam"):
        return method
    return "exact" if method == "auto" and n <= CARRY_AGAIN_UP_TO[effort] else None


def _goal(objective: ObjectiveName | Objective) -> Objective:
    return objective if isinstance(objective, Objective) else Objective(objective)


def _check(method: str, effort: str, time_limit_s: float | None, workers: int) -> None:
    """Refuse what is not worth beginning; ``Search`` looks at the seed."""
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
        ways = [directed(problem, order, objective)]
        ways += [
            (2 * order + flip).astype(np.int32)
            for flip in (0, 1)
            if problem.refusal(order, np.full(problem.n, flip)) is None
        ]
        return min(ways, key=lambda oriented: true_cost(problem, objective, oriented))
    flipped = np.asarray(flips)
    if flipped.shape != order.shape:
        raise SequenceError(f"the initial directions have shape {flipped.shape}, but must have {order.shape}")
    flipped = flipped.astype(bool)
    refused = problem.refusal(order, flipped)
    if refused is not None:
        raise SequenceError(f"the initial sequence cannot be printed: {refused}")
    oriented: NDArray[np.int32] = (2 * order + flipped).astype(np.int32)
    return oriented
