"""What Dask costs a study: tasks that do nothing, tiny sheets in earnest, and sleepers on many workers.

    python benchmarks/study_overhead.py [--tasks 20000] [--sleepers 100] [--sheets 2000]

prints the time of each task beyond its work, and what this process, client and scheduler in one, computes for
each. Sleepers are ``WORKERS_A_PROCESS`` workers in each of some processes beside this one. With one task a
parcel, a row says what a parcel costs.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from distributed import Client, LocalCluster

from studies import Factor, Study
from studies import run as running
from studies.cluster import local_cluster
from studies.run import run
from studies.store import Store

FIGURES = {"done": bool}
TASK = "sleeping:sleep"
SLEEP_MS, SLEEPS = 500.0, 40
"""How long a sleeper's task takes, and how many of them each sleeper gets."""
WORKERS_A_PROCESS = 25
MOST_WAIT_S = 120.0
HEADS = (
    "what", "tasks", "workers", "wall, s", "work, s", "of it search, s", "beyond it, ms a task",
    "beyond it, %",
    "computed here, ms a task", "bytes a row", "MB here",
)  # fmt: skip


def resident_mb():
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return float("nan")


def row(what, study, call, client, figures):
    """Run a study, and print a line of the table."""
    workers = len(client.nthreads())
    with tempfile.TemporaryDirectory() as folder, Store(Path(folder), study, figures, "1") as store:
        run(
            Study("warm", (*study.factors[:-1], Factor(study.factors[-1].name, (10**9,)))),
            call,
            store,
            client,
        )
        begin, computed = time.perf_counter(), time.process_time()
        standing = run(study, call, store, client)
        wall, computed = time.perf_counter() - begin, time.process_time() - computed
        store.flush()
        from studies.store import load

        rows = load(Path(folder)).to_pydict()
        size = sum(path.stat().st_size for path in (Path(folder) / "parts").iterdir())
    if standing.failed:
        raise SystemExit(f"{standing.failed} tasks failed: {next(filter(None, rows['error']))}")
    tasks, work = len(study), sum(rows["seconds"])
    search = f"{sum(rows['search_s']):.1f}" if "search_s" in rows else ""
    beyond_ms, beyond = 1000 * (wall - work / workers) / tasks, 100 * (wall * workers / work - 1)
    cells = (
        what, tasks, workers, f"{wall:.1f}", f"{work:.1f}", search, f"{beyond_ms:.3f}", f"{beyond:.1f}",
        f"{1000 * computed / tasks:.3f}", f"{size / tasks:.0f}", f"{resident_mb():.0f}",
    )  # fmt: skip
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def main():
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--tasks", type=int, default=20_000)
    asked.add_argument("--sleepers", type=int, default=100)
    asked.add_argument("--sheets", type=int, default=2000)
    asked.add_argument("--only", choices=("nothing", "sheets", "sleepers"))
    words = asked.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{cores} cores\n\n| " + " | ".join(HEADS) + " |\n" + "|---" * len(HEADS) + "|", flush=True)
    if words.only in (None, "nothing"):
        of_nothing(cores, words.tasks)
    if words.only in (None, "sheets"):
        of_sheets(cores, words.sheets)
    if words.only in (None, "sleepers"):
        with sleeping(words.sleepers) as client:
            row(f"sleep {SLEEP_MS / 1000} s", tasks(SLEEP_MS, SLEEPS * words.sleepers), TASK, client, FIGURES)


def tasks(ms: float, count: int) -> Study:
    return Study("tasks", (Factor("ms", (ms,)), Factor("k", tuple(range(count)))))


def of_nothing(cores: int, count: int) -> None:
    with local_cluster(cores, 1500) as client:
        client.run(sys.path.append, str(Path(__file__).parent))
        row("nothing", tasks(0.0, count), TASK, client, FIGURES)
        most, running.MOST_IN_PARCEL = running.MOST_IN_PARCEL, 1
        row("nothing, one task a parcel", tasks(0.0, count // 10), TASK, client, FIGURES)
        running.MOST_IN_PARCEL = most


def of_sheets(cores: int, count: int) -> None:
    from vslice.experiment import CALL
    from vslice.experiment import FIGURES as SHEETS

    tiny = Study(
        "tiny",
        (Factor("tiles", ("2x2",)), Factor("method", ("greedy",)), Factor("machine", ("paper",)),
         Factor("objective", ("straight",)), Factor("sheet", tuple(range(count)))),
    )  # fmt: skip
    with local_cluster(cores, 1500) as client:
        row("2x2 sheets, greedy", tiny, CALL, client, SHEETS)


@contextmanager
def sleeping(workers: int) -> Iterator[Client]:
    """A scheduler in this process and workers of one thread in others, killed at the end."""
    command = [sys.executable, str(Path(__file__).with_name("sleeping.py"))]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    processes = []
    with (
        LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        try:
            for first in range(0, workers, WORKERS_A_PROCESS):
                count = min(WORKERS_A_PROCESS, workers - first)
                processes.append(
                    subprocess.Popen(
                        [*command, cluster.scheduler_address, str(count)],
                        env=environment,
                        stderr=subprocess.DEVNULL,
                    )
                )
            client.wait_for_workers(workers, timeout=MOST_WAIT_S)
            yield client
        finally:
            for process in processes:
                process.kill()
                process.wait()


if __name__ == "__main__":
    main()
