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
from multiprocessing import active_children, get_context
from multiprocessing.process import BaseProcess
from types import FrameType

from slicer.errors import SequenceError
from slicer.sequence.construct import start_greedily
from slicer.sequence.layered import merge_tours
from slicer.sequence.problem import Outcome, Search

Searching = Callable[[Search, str], None]
Run = Future[Outcome | None]

STRIDE = 1_000_003
"""Between the seeds of two workers, so that runs with neighbouring seeds share none."""


def run_workers(search: Search, searching: Searching, method: str, workers: int) -> None:
    """Run ``searching`` with ``workers`` seeds, and keep the best bound and the cheapest sequence.

    That is one of theirs or the best crossing of them.

    On Ctrl-C each returns what it has, and greedy's sequence stands in where none has any. The deadline
    counts the time in which the processes start.

    Raises:
        SequenceError: a process was ended from outside.
    """
    runs: list[Run] = []
    found: list[Outcome | None] = []
    interrupted = False
    others = active_children()
    # The clocks of two processes agree on the time of day alone.
    ends = None if search.deadline is None else time.time() + search.deadline - time.perf_counter()
    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            try:
                with _signals_held():  # processes begin with the signals held that are held here
                    for k in range(workers):
                        mine = search.apart(search.seed + STRIDE * k)
                        runs.append(pool.submit(_run, mine, searching, method, ends))
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
    for one in have:
        search.absorb(one)
    search.stopped = search.stopped or interrupted
    if not search.started:
        start_greedily(search)
    sequences = [one.oriented for one in have if one.oriented is not None]
    if len(sequences) > 1 and not search.proved:
        search.offer(merge_tours(search.problem, search.objective, sequences))


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


def _done(runs: list[Run]) -> list[Outcome | None]:
    """What those have found that came to their end."""
    return [run.result() for run in runs if run.done() and run.exception() is None]


def _run(search: Search, searching: Searching, method: str, ends: float | None) -> Outcome | None:
    """In the worker: search until ``ends``, a time of day. None where Ctrl-C left nothing to return.

    The worker hears of Ctrl-C only while it searches. Before, it is busy importing, and after it would die
    on the way to its answer; both would take the answers of all the others with it.
    """
    left = None if ends is None else ends - time.time()
    search.deadline = None if left is None else time.perf_counter() + left
    if _answered:
        return None
    try:
        with _signals_heard():
            searching(search, method)
    except KeyboardInterrupt:
        search.stopped = True
    return search.outcome() if search.started else None


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
