"""Several processes at once, each with a seed of its own; what they find is spliced."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing import active_children, get_context
from multiprocessing.process import BaseProcess
from types import FrameType

from slicer.errors import SequenceError
from slicer.sequence.construct import first_hill_climb
from slicer.sequence.layered import RELATIVE_EPS, merge_tours
from slicer.sequence.problem import Found, Options, Problem, true_cost

Search = Callable[[Problem, str, Options], Found]
Run = Future[Found | None]

STRIDE = 1_000_003
"""Between the seeds of two workers, so that runs with neighbouring seeds share none."""


def run_workers(problem: Problem, search: Search, method: str, options: Options, workers: int) -> Found:
    """Run ``search`` with ``workers`` seeds, and keep the best bound and the cheapest sequence.

    That is one of theirs or the best crossing of them.

    On Ctrl-C each returns what it has. Where it comes so early that none has anything, the initial sequence
    is returned, or greedy's. The deadline counts the time in which the processes start.

    Raises:
        SequenceError: a process was ended from outside.
    """
    runs: list[Run] = []
    found: list[Found | None] = []
    interrupted = False
    others = active_children()
    # The clocks of two processes agree on the time of day alone.
    ends = None if options.deadline is None else time.time() + options.deadline - time.perf_counter()
    plain = replace(options, deadline=None, progress=None)
    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            try:
                with _signals_held():  # processes begin with the signals held that are held here
                    for k in range(workers):
                        mine = replace(plain, seed=options.seed + STRIDE * k)
                        runs.append(pool.submit(_run, problem, search, method, mine, ends))
                found = [run.result() for run in runs]
            except KeyboardInterrupt:
                interrupted = True
                _interrupt(others)
                found = [run.result() for run in runs]
    except BrokenProcessPool as why:
        if not interrupted:
            raise SequenceError(
                f"one of the {workers} workers ended without an answer: killed, out of memory, or unable to "
                'start. Use fewer workers; in a script, call this below `if __name__ == "__main__"`.'
            ) from why
        found = _done(runs)
    except KeyboardInterrupt:  # before the first of them began, or a second time
        interrupted = True
        found = _done(runs)
    have = [one for one in found if one is not None]
    if not have:
        start = options.initial
        return Found(first_hill_climb(problem, options) if start is None else start, stopped=True)
    bounds = [one.lower_bound_mm for one in have if one.lower_bound_mm is not None]
    sequences = [one.oriented for one in have]
    costs = [true_cost(problem, options.objective, oriented) for oriented in sequences]
    best = sequences[costs.index(min(costs))]
    bound = max(bounds, default=0.0) if options.objective.name == "straight" else 0.0
    if min(costs) > bound * (1 + RELATIVE_EPS):
        try:
            spliced = merge_tours(problem, options.objective, sequences)
            if true_cost(problem, options.objective, spliced) < min(costs):
                best = spliced
        except KeyboardInterrupt:
            interrupted = True
    return Found(
        best,
        nodes_visited=sum(one.nodes_visited for one in have),
        states_created=sum(one.states_created for one in have),
        lower_bound_mm=max(bounds, default=None),
        stopped=interrupted or any(one.stopped for one in have),
    )


def _interrupt(others: list[BaseProcess]) -> None:
    """Tell all processes but ``others`` of Ctrl-C.

    A terminal tells every process that there is; not those that begin a moment later.
    """
    if sys.platform == "win32":
        return
    for process in active_children():
        if process not in others and process.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGINT)


def _done(runs: list[Run]) -> list[Found | None]:
    """What those have found that came to their end."""
    return [run.result() for run in runs if run.done() and run.exception() is None]


def _run(problem: Problem, search: Search, method: str, options: Options, ends: float | None) -> Found | None:
    """In the worker: search until ``ends``, a time of day. None where Ctrl-C left nothing to return.

    The worker hears of Ctrl-C only while it searches. Before, it is busy importing, and after it would die
    on the way to its answer; both would take the answers of all the others with it.
    """
    left = None if ends is None else ends - time.time()
    deadline = None if left is None else time.perf_counter() + left
    found: Found | None = None
    if _answered:
        return None
    try:
        with _signals_heard():
            found = search(problem, method, replace(options, deadline=deadline))
    except KeyboardInterrupt:
        pass
    return found


@contextmanager
def _signals_held() -> Iterator[None]:
    """Keep Ctrl-C waiting, here and in processes that begin meanwhile; it is raised at the end.

    A mask holds it from this thread and is inherited, but any other thread may take it in. Python answers it
    in the main thread all the same, so that the answer there waits as well.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    waiting: list[FrameType | None] = []
    main = threading.current_thread() is threading.main_thread()
    answer = signal.signal(signal.SIGINT, lambda _, frame: waiting.append(frame)) if main else None
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if answer is not None:
            signal.signal(signal.SIGINT, answer)
        if waiting and callable(answer):
            answer(signal.SIGINT, waiting[0])


@contextmanager
def _signals_heard() -> Iterator[None]:
    """Hear of Ctrl-C once, one that has waited included.

    A second one, which the caller may have sent on, would strike while the first is being answered.
    """
    signal.signal(signal.SIGINT, _once)
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


_answered: list[int] = []
"""In a worker: the Ctrl-C that it has heard. What else waits for it is called off too."""


def _once(number: int, _frame: FrameType | None) -> None:
    _answered.append(number)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt
