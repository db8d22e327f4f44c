"""Tasks on Dask: a few parcels under way for each worker, each row kept as soon as it is back.

The scheduler never holds more than a window of tasks, however many there are. Tiny tasks go in parcels of
about ``PARCEL_S``, of more where there are many workers: what Dask takes for each, some milliseconds, then is
small beside them, and the scheduler has no more than ``PARCELS_A_SECOND`` to serve.
"""

import logging
import math
import queue
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

import dask
from distributed import CancelledError, Client, Event, Future, KilledWorker, LocalCluster, Nanny

from studies.design import Study, key_of
from studies.errors import StudyError
from studies.store import Store
from studies.work import ready, work

PARCEL_S, MOST_IN_PARCEL = 1.0, 1000
PARCELS_A_WORKER = 2
PARCELS_A_SECOND = 100
TRIES = 2
"""How often a task that is looked at may take its worker with it before it counts as failed."""
MOST_BYSTANDING = 20
"""How often a task may lose its worker before it began: then it is what cannot be begun."""
SILENCE_S = 60.0
"""For so long may a scheduler be out of reach."""
READY_S = 1.0
"""How often it is asked whether a worker that gets ready is still there."""

GONE = "the scheduler is gone; what has come back is kept. Run the same command again to go on."

Parcel = list[tuple[int, str, dict[str, Any]]]


@dataclass
class Standing:
    """How a run stands: tasks done by now and before, failures, all of them, and workers there are."""

    done: int
    before: int
    failed: int
    total: int
    workers: int = 0


@contextmanager
def local_cluster(workers: int, memory_mb: int) -> Iterator[Client]:
    """A cluster of this process, one thread a worker, reached from this machine alone.

    Args:
        memory_mb: that each worker may take; above it Dask restarts the worker.
    """
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with (
        # A task that took its worker with it is this module's affair, and costs a new process each time.
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            worker_class=Nanny,
            memory_limit=f"{memory_mb}MiB",
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


@contextmanager
def elsewhere(address: str) -> Iterator[Client]:
    """The client of a scheduler that runs.

    Raises:
        StudyError: nobody answers there, or it has no worker.
    """
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise StudyError(f"{address}: no scheduler answers: {error}.") from None
    with client:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            raise StudyError(f"{address}: this scheduler has no workers; start some, then run this again.")
        yield client


def run(
    study: Study, call: str, store: Store, client: Client, told: Callable[[Standing], None] | None = None
) -> Standing:
    """Run what is left of a study, and keep each row as it comes.

    Args:
        call: "module:function", to be found by that name on every worker.
        told: how it stands, a few times a second at most.

    Raises:
        StudyError: the scheduler is gone; what was kept until then is kept.
    """
    _check_workers(call, client)
    done = len(store.finished) + len(store.failed)
    standing = Standing(done, done, len(store.failed), len(study))
    left = (
        (index, key, task)
        for index, (key, task) in enumerate((key_of(task), task) for task in study.tasks())
        if key not in store.finished and key not in store.failed
    )
    _Runner(call, store, client, standing, told).run(left)
    return standing


def _check_workers(call: str, client: Client) -> None:
    """See that every worker has the function, and let it get ready.

    Raises:
        StudyError: one has not.
    """
    asked = {
        worker: client.submit(ready, call, workers=[worker], pure=False, allow_other_workers=False)
        for worker in client.nthreads()
    }
    for worker, future in asked.items():
        if (error := _answer(worker, future, client)) is not None:
            raise StudyError(
                f"{worker}: this worker cannot run {call}: {type(error).__name__}: {error}. Install the same "
                "version of the software there as here."
            )


def _answer(worker: str, future: Future, client: Client) -> BaseException | None:
    """What went wrong there; nothing where the worker has gone meanwhile: its place is another's.

    Raises:
        StudyError: the scheduler is gone.
    """
    while True:
        try:
            error: BaseException | None = future.exception(timeout=READY_S)
        except TimeoutError:
            error = None
        except (OSError, CancelledError):
            raise StudyError(GONE) from None
        if future.status in ("cancelled", "lost"):
            raise StudyError(GONE)
        if future.done():
            return None if isinstance(error, KilledWorker) else error
        try:
            there = client.nthreads()
        except OSError:
            raise StudyError(GONE) from None
        if worker not in there:
            return None


class _Runner:
    """The parcels of a run."""

    def __init__(
        self,
        call: str,
        store: Store,
        client: Client,
        standing: Standing,
        told: Callable[[Standing], None] | None,
    ) -> None:
        self._call, self._store, self._client = call, store, client
        self._standing, self._told = standing, told
        self._back: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._away: dict[str, tuple[Future, Parcel]] = {}
        self._again: deque[Parcel] = deque()
        self._tries: dict[str, int] = {}
        """How often each suspect took its worker with it; only these say when they begin."""
        self._stood_by: dict[str, int] = {}
        self._size, self._heard, self._spoke, self._sent = 1, time.monotonic(), 0.0, 0
        self._counted = -math.inf

    def run(self, left: Iterator[tuple[int, str, dict[str, Any]]]) -> None:
        try:
            self._send(left)
            while self._away:
                try:
                    future = self._back.get(timeout=1.0)
                except queue.Empty:
                    self._check_scheduler()
                    self._tell()
                    continue
                self._heard = time.monotonic()
                _, parcel = self._away.pop(future.key)
                self._take(future, parcel)
                future.release()
                self._send(left)
                self._tell()
        finally:
            # Where the scheduler is gone there is nobody to call them back from.
            if self._away and self._client.status == "running":
                with suppress(OSError, TimeoutError):
                    self._client.cancel([future for future, _ in self._away.values()], force=True)

    def _send(self, left: Iterator[tuple[int, str, dict[str, Any]]]) -> None:
        self._count_workers()
        window = PARCELS_A_WORKER * max(1, self._standing.workers)
        while len(self._away) < window:
            parcel = self._again.popleft() if self._again else list(islice(left, self._size))
            if not parcel:
                return
            self._sent += 1
            name = f"{parcel[0][1]}-{self._sent}"
            begun = name if parcel[0][1] in self._tries else None
            future = self._client.submit(work, self._call, parcel, begun, pure=False, key=name, retries=0)
            self._away[future.key] = future, parcel
            future.add_done_callback(self._back.put)

    def _take(self, future: Future, parcel: Parcel) -> None:
        """Keep the rows of a parcel; where its worker died, try its tasks one by one.

        Dask blames all that a dead worker had, also what still waited there; so whoever is tried again says
        when it begins, and only what had begun took its worker with it.
        """
        begun = self._begun(future, parcel)
        if future.status == "finished":
            try:
                rows = future.result()
            except OSError:  # they lie with a worker that is gone with the scheduler
                raise StudyError(GONE) from None
            self._standing.done += self._store.append(rows)
            self._standing.failed += sum(row["error"] is not None for row in rows)
            mean = sum(row["seconds"] for row in rows) / len(rows)
            wanted_s = max(PARCEL_S, self._standing.workers / PARCELS_A_SECOND)
            fit = int(min(wanted_s / max(mean, 1e-6), MOST_IN_PARCEL))
            self._size = max(1, min(fit, 4 * self._size))
            return
        if future.status in ("cancelled", "lost"):
            raise StudyError(GONE)
        error = future.exception()
        if parcel[0][1] not in self._tries:
            self._tries |= dict.fromkeys((key for _, key, _ in parcel), 0)
            self._again.extend([task] for task in parcel)
            return
        ((index, key, task),) = parcel
        counted = self._tries if begun else self._stood_by
        counted[key] = counted.get(key, 0) + 1
        if self._tries[key] < TRIES and self._stood_by.get(key, 0) < MOST_BYSTANDING:
            self._again.append(parcel)
            return
        row = {"index": index, "key": key, **task, "error": f"{type(error).__name__}: {error}"[:500]}
        self._standing.done += self._store.append([row])
        self._standing.failed += 1

    def _begun(self, future: Future, parcel: Parcel) -> bool:
        """Whether a suspect had begun; the scheduler then forgets it.

        Raises:
            StudyError: the scheduler is gone.
        """
        if parcel[0][1] not in self._tries:
            return False
        event = Event(future.key, client=self._client)
        try:
            begun = bool(event.is_set())
            event.clear()
        except (OSError, CancelledError):
            raise StudyError(GONE) from None
        return begun

    def _count_workers(self) -> None:
        """Ask how many workers there are, twice a second at most: it is a way to the scheduler and back."""
        if time.monotonic() - self._counted < 0.5:
            return
        try:
            self._standing.workers = len(self._client.nthreads())
        except OSError:
            raise StudyError(GONE) from None
        self._counted = time.monotonic()

    def _check_scheduler(self) -> None:
        if self._client.status == "running":
            self._heard = time.monotonic()
            self._count_workers()
        elif time.monotonic() - self._heard > SILENCE_S or self._client.status == "closed":
            raise StudyError(GONE)

    def _tell(self) -> None:
        if self._told is not None and time.monotonic() - self._spoke > 0.25:
            self._spoke = time.monotonic()
            self._told(self._standing)
