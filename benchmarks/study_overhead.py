"""What Dask costs a study: tasks that do nothing, tiny sheets in earnest, and sleepers on many workers.

    python benchmarks/study_overhead.py [--tasks 20000] [--sleepers 100] [--sheets 2000]

prints the time of each task beyond its work, and what this process, client and scheduler in one, computes for
each. Sleepers are workers in this process too, so their own share is in it: what a hundred machines would
leave to the scheduler is less. A row with one task a parcel is what a parcel costs.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from studies import Factor, Study
from studies import run as running
from studies.run import local_cluster, run
from studies.store import Store

FIGURES = {"done": bool}
TASK = "sleeping:sleep"
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
    words = asked.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{cores} cores\n\n| " + " | ".join(HEADS) + " |\n" + "|---" * len(HEADS) + "|", flush=True)
    with local_cluster(cores, 1500) as client:
        client.run(sys.path.append, str(Path(__file__).parent))
        nothing = Study("nothing", (Factor("ms", (0.0,)), Factor("k", tuple(range(words.tasks)))))
        row("nothing", nothing, TASK, client, FIGURES)
        most, running.MOST_IN_PARCEL = running.MOST_IN_PARCEL, 1
        alone = Study("alone", (Factor("ms", (0.0,)), Factor("k", tuple(range(words.tasks // 10)))))
        row("nothing, one task a parcel", alone, TASK, client, FIGURES)
        running.MOST_IN_PARCEL = most
        from vslice.experiment import CALL
        from vslice.experiment import FIGURES as SHEETS

        tiny = Study(
            "tiny",
            (Factor("tiles", ("2x2",)), Factor("method", ("greedy",)), Factor("machine", ("paper",)),
             Factor("objective", ("straight",)), Factor("sheet", tuple(range(words.sheets)))),
        )  # fmt: skip
        row("2x2 sheets, greedy", tiny, CALL, client, SHEETS)
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=words.sleepers, threads_per_worker=1, processes=False, dashboard_address=None
        ) as many,
        Client(many) as client,
    ):
        tasks = 20 * words.sleepers
        sleepers = Study("sleepers", (Factor("ms", (500.0,)), Factor("k", tuple(range(tasks)))))
        row("sleep 0.5 s", sleepers, TASK, client, FIGURES)


if __name__ == "__main__":
    main()
