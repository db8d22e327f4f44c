"""Where tasks run: a cluster of this process or a scheduler elsewhere, whose workers must know the work."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import dask
from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster, Nanny

from studies.errors import StudyError
from studies.work import ready

READY_S = 1.0
"""How often it is asked whether a worker that gets ready is still there."""

GONE = "the scheduler is gone; what has come back is kept. Run the same command again to go on."


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


def replace_lost(client: Client, workers: int) -> None:
    """See that a cluster of this process has so many workers again; elsewhere somebody else does.

    A process that watches a worker gives up where that dies while it starts. Dask forgets both after its
    ``lost-worker-timeout``, and opens new ones when it is asked.
    """
    if isinstance(client.cluster, LocalCluster):
        client.cluster.scale(workers)


def check_workers(call: str, client: Client) -> None:
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
        if future.status == "cancelled":
            raise StudyError(GONE)
        if future.done():
            return None if isinstance(error, KilledWorker) else error
        try:
            there = client.nthreads()
        except OSError:
            raise StudyError(GONE) from None
        if worker not in there:
            return None
