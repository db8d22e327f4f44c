"""Tasks on Dask: a few parcels under way for each worker, each row kept as soon as it is back.

The scheduler never holds more than a window of tasks, however many there are. Tiny tasks go in parcels of
about ``PARCEL_S``, of more where there are many workers: what Dask takes for each, some milliseconds, then is
small beside them, and the scheduler has no more than ``PARCELS_A_SECOND`` to serve.
"""

import math
import queue
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

from distributed import CancelledError, Client, Event, Future, KilledWorker

from studies.cluster import GONE, check_workers, replace_lost
from studies.design import Study, key_of
from studies.errors import StudyError
from studies.store import Store
from studies.work import work

PARCEL_S, MOST_IN_PARCEL = 1.0, 1000
PARCELS_A_WORKER = 2
PARCELS_A_SECOND = 100
TRIES = 2
"""How often a task that is looked at may take its worker with it before it counts as failed."""
MOST_BYSTANDING = 20
"""How often a task may lose its worker before it began: then it is what cannot be begun."""
SILENCE_S = 60.0
"""For so long may a scheduler be out of reach."""

MOST_AT_ONCE = 100
"""How many parcels are fetched together: what is fetched is not kept yet."""

Parcel = list[tuple[int, str, dict[str, Any]]]
Row = dict[str, Any]


@dataclass
class Standing:
    """How a run stands: tasks done by now and before, failures, all of them, and workers there are."""

    done: int
    before: int
    failed: int
    total: int
    workers: int = 0


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
    check_workers(call, client)
    done = len(store.finished) + len(store.failed)
    standing = Standing(done, done, len(store.failed), len(study))
    left = (
        (index, key, task)
        for index, (key, task) in enumerate((key_of(task), task) for task in study.tasks())
        if key not in store.finished and key not in store.failed
    )
    _Runner(call, store, client, standing, told).run(left)
    return standing


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
        self._counted, self._most = -math.inf, 0

    def run(self, left: Iterator[tuple[int, str, dict[str, Any]]]) -> None:
        try:
            self._send(left)
            while self._away:
                back = self._come_back()
                if not back:
                    self._check_scheduler()
                    self._tell()
                    continue
                self._heard = time.monotonic()
                for future, rows in zip(back, self._gather(back), strict=True):
                    if rows is None and future.status in ("lost", "pending"):
                        # Its rows died with their worker, and Dask has them computed again.
                        future.add_done_callback(self._back.put)
                        continue
                    _, parcel = self._away.pop(future.key)
                    self._take(future, parcel, rows)
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

    def _come_back(self) -> list[Future]:
        """All that are back; none after a second without any."""
        back: list[Future] = []
        try:
            back.append(self._back.get(timeout=1.0))
            while len(back) < MOST_AT_ONCE:
                back.append(self._back.get_nowait())
        except queue.Empty:
            pass
        return back

    def _gather(self, back: list[Future]) -> list[list[Row] | None]:
        """Rows of each parcel, fetched together: a way to the scheduler and to a worker takes milliseconds.

        None stands for those of a worker that died, with the parcel or after it.

        Raises:
            StudyError: the scheduler is gone.
        """
        finished = [future for future in back if future.status == "finished"]
        try:
            rows = dict(zip(finished, self._client.gather(finished), strict=True))
        except KilledWorker:
            rows = {future: self._result(future) for future in finished}
        except (OSError, CancelledError):  # they lie with workers that are gone with the scheduler
            raise StudyError(GONE) from None
        return [rows.get(future) for future in back]

    def _result(self, future: Future) -> list[Row] | None:
        try:
            rows: list[Row] = future.result()
        except KilledWorker:
            return None
        except (OSError, CancelledError):
            raise StudyError(GONE) from None
        return rows

    def _take(self, future: Future, parcel: Parcel, rows: list[Row] | None) -> None:
        """Keep the rows of a parcel; where its worker died, try its tasks one by one.

        Dask blames all that a dead worker had, also what still waited there; so whoever is tried again says
        when it begins, and only what had begun took its worker with it.
        """
        begun = self._begun(future, parcel)
        if rows is not None:
            self._standing.done += self._store.append(rows)
            self._standing.failed += sum(row["error"] is not None for row in rows)
            mean = sum(row["seconds"] for row in rows) / len(rows)
            wanted_s = max(PARCEL_S, self._standing.workers / PARCELS_A_SECOND)
            fit = math.ceil(min(wanted_s / max(mean, 1e-6), MOST_IN_PARCEL))
            self._size = max(1, min(fit, 4 * self._size))
            return
        if future.status == "cancelled":
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
        if self._standing.workers < self._most:
            replace_lost(self._client, self._most)
        self._most = max(self._most, self._standing.workers)

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
