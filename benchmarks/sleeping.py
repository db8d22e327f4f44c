"""The task of ``study_overhead.py``, found by workers by its name, and workers that run it.

    python benchmarks/sleeping.py SCHEDULER WORKERS

stays until it is killed or the scheduler is gone.
"""

import asyncio
import sys
import time
from contextlib import AsyncExitStack


def sleep(task):
    """So many milliseconds in which nothing is computed."""
    time.sleep(task["ms"] / 1000)
    return {"done": True}


async def work(scheduler, workers):
    """Workers of one thread each, all in this process."""
    import dask
    from distributed import Worker

    # What watches a worker takes a share of one core on each machine, but all of one for a hundred on one.
    dask.config.set(
        {"distributed.worker.profile.enabled": False, "distributed.admin.system-monitor.interval": "10s"}
    )
    async with AsyncExitStack() as opened:
        for _ in range(workers):
            worker = await opened.enter_async_context(Worker(scheduler, nthreads=1, memory_limit=0))
        await worker.finished()


if __name__ == "__main__":
    asyncio.run(work(sys.argv[1], int(sys.argv[2])))
