"""Processes that tests of studies start and kill: clients, schedulers and workers."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

TESTS = Path(__file__).parent

SERVER = """
    import asyncio, sys
    from distributed import Scheduler, Worker
    async def main():
        async with Scheduler(port=int(sys.argv[2]), host="127.0.0.1", dashboard=False) as scheduler:
            print(scheduler.address, flush=True)
            await scheduler.finished()
    async def work():
        async with Worker(sys.argv[2], nthreads=1) as worker:
            print("up", flush=True)
            await worker.finished()
    asyncio.run(main() if sys.argv[1] == "scheduler" else work())
"""


def children(script, *words):
    """A process of this interpreter that runs a script."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(str, (TESTS, TESTS / "studies", TESTS.parent)))
    }
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script), *map(str, words)], env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip


class Served:
    """A scheduler with workers, each a process that can be killed."""

    def __init__(self, workers=2):
        self.scheduler = children(SERVER, "scheduler", 0)
        self.address = self.scheduler.stdout.readline().strip()
        self.workers = [children(SERVER, "worker", self.address) for _ in range(workers)]
        for worker in self.workers:
            assert worker.stdout.readline().strip() == "up"

    def replace_worker(self, k):
        """Kill a worker, and start another."""
        ended(self.workers[k])
        self.workers[k] = children(SERVER, "worker", self.address)

    def __enter__(self):
        return self

    def __exit__(self, *reason):
        ended(self.scheduler, *self.workers)


def ended(*processes):
    """Kill and bury processes."""
    for process in processes:
        process.kill()
    for process in processes:
        process.wait()
        process.stdout.close()
