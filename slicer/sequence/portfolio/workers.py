"""Several processes at once, each with a seed of its own; what they find is merged.

Each has a pipe, through which it gets its search and tells of every better sequence. So nothing that it has
told is lost when it is ended, and it is ended when the time limit has passed, on Ctrl-C, and when the parent
ends, however that comes.
"""

import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler

from slicer.errors import SequenceError, SequenceWarning
from slicer.processes import end_with_parent
from slicer.sequence.construct import start_greedily
from slicer.sequence.layered import merge_tours
from slicer.sequence.portfolio.capacity import allowed_workers
from slicer.sequence.problem import Outcome, Progress, Search

Searching = Callable[[Search, str], None]

STRIDE = 1_000_003
"""Between the seeds of two workers, so that runs with neighbouring seeds share none."""
MERGING_SHARE = 0.02
"""Of a time limit, what is kept for merging what the workers find."""
GRACE_S = 1.0
"""How long beyond its time a worker may take to answer before it is ended."""


def run_workers(search: Search, searching: Searching, method: str, workers: int) -> None:
    """Run ``searching`` with ``workers`` seeds, and keep the best bound and the cheapest sequence.

    That is one of theirs or the best crossing of them. No more of them run than the machine can carry, which
    a ``SequenceWarning`` says. The deadline counts the time in which the processes start. Where it passes or
    Ctrl-C comes, what they have told so far counts, and greedy's sequence stands in where none has any.

    Raises:
        SequenceError: all processes were ended from outside, or one of them raised it.
    """
    workers, why = allowed_workers(workers)
    if why is not None:
        warnings.warn(why, SequenceWarning, stacklevel=3)
    if workers == 1:
        searching(search, method)
        return
    team: list[Worker] = []
    try:
        with _interrupts_held():
            team.extend(Worker() for _ in range(workers))
        for k, worker in enumerate(team):
            worker.give(search.apart(search.seed + STRIDE * k), searching, method, _time_of_day(search))
        _listen(team, search)
    except KeyboardInterrupt:
        search.stopped = True
    finally:
        for worker in team:
            worker.end()
    _take(team, search)
    if not search.started:
        start_greedily(search)
    found = [worker.told.oriented for worker in team if worker.told and worker.told.oriented is not None]
    if len(found) > 1 and not search.proved and not search.late():
        search.offer(merge_tours(search.problem, search.objective, found))


def _time_of_day(search: Search) -> float | None:
    """When the workers should stop, on the one clock which they share; None for no limit."""
    left = search.time_left()
    return None if left is None else time.time() + left * (1.0 - MERGING_SHARE)


def _listen(team: Sequence["Worker"], search: Search) -> None:
    """Hear the workers until each has answered or is lost, or the time is over; pass on their progress."""
    shown = search.apart(search.seed)
    shown.listener = search.listener
    waiting = list(team)
    while waiting:
        left = search.time_left()
        if left is not None and left + GRACE_S <= 0.0:
            search.stopped = True
            return
        ready = wait([worker.connection for worker in waiting], None if left is None else left + GRACE_S)
        for worker in [worker for worker in waiting if worker.connection in ready]:
            if not worker.hear():
                waiting.remove(worker)
            elif worker.told is not None:
                shown.absorb(worker.told)
                shown.report(worker.stage)


def _take(team: Sequence["Worker"], search: Search) -> None:
    """Take what all have told, in the order of their seeds: of equal sequences the first is kept."""
    lost = [worker for worker in team if worker.lost]
    for worker in team:
        if worker.failed is not None:
            raise worker.failed
        if worker.told is not None:
            search.absorb(worker.told)
        search.stopped = search.stopped or not worker.answered
    if not lost:
        return
    said = (
        f"{len(lost)} of the {len(team)} workers ended without an answer: killed, out of memory, or unable "
        'to start. Use fewer workers; in a script, call this below `if __name__ == "__main__"`.'
    )
    if len(lost) == len(team):
        raise SequenceError(said)
    warnings.warn(said, SequenceWarning, stacklevel=4)


class Worker:
    """A process that searches, as the one that started it sees it.

    Attributes:
        connection: the parent's end of the pipe.
        told: the latest that it has told; the answer, once it is ``answered``.
        stage: what it had just done.
        answered, lost: whether it has come to its end, or was ended by something else.
        failed: what it raised.
    """

    def __init__(self) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.told: Outcome | None = None
        self.stage = ""
        self.answered = self.lost = False
        self.failed: Exception | None = None
        self._process = context.Process(target=work, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()  # else the pipe would not end when the worker does

    def give(self, search: Search, searching: Searching, method: str, ends: float | None) -> None:
        """Tell it what to do, without waiting for it to start: a sheet may be more than a pipe can hold."""
        task = ForkingPickler.dumps((search, searching, method, ends))

        def send() -> None:
            with suppress(OSError):  # it has ended, which the other end of the pipe tells
                self.connection.send_bytes(task)

        threading.Thread(target=send, daemon=True).start()

    def hear(self) -> bool:
        """Take the next that it tells; whether more may come."""
        if self.answered or self.failed is not None:
            return False
        try:
            told = self.connection.recv()
        except (EOFError, OSError):
            self.lost = True
            return False
        if isinstance(told, Exception):
            self.failed = told
        else:
            self.stage, self.told, self.answered = told
        return not self.answered and self.failed is None

    def end(self) -> None:
        """End it, and wait until it has ended; what it has told and nobody has heard is heard."""
        with suppress(EOFError, OSError):
            while self.connection.poll() and self.hear():
                pass
        self._process.kill()
        self._process.join()
        self.connection.close()


def work(connection: Connection) -> None:
    """In the worker: search as told through the pipe, and tell of every better sequence and of the end."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears of Ctrl-C, and ends its workers
    try:
        search, searching, method, ends = connection.recv()
    except EOFError:
        return
    if ends is not None:
        search.deadline = time.perf_counter() + ends - time.time()
    best = float("inf"), 0.0

    def tell(progress: Progress) -> None:
        nonlocal best
        now = search.cost, -search.lower_bound
        if now != best:
            connection.send((progress.stage, search.outcome(), False))
            best = now

    search.listener = tell
    try:
        searching(search, method)
        connection.send(("end", search.outcome(), True))
    except SequenceError as why:
        connection.send(why)
    except MemoryError:
        raise  # the parent counts it among those without an answer
    except Exception:  # noqa: BLE001 - raised again in the parent
        connection.send(RuntimeError(f"a worker failed:\n{traceback.format_exc()}"))


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Keep Ctrl-C from processes that begin meanwhile, until they ignore it; it is raised here at the end.

    A terminal tells every process of the group. A mask is inherited, and so holds it back from the first
    moment on.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the first process of all starts it, which lifts the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
