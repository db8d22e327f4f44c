"""What Dask costs a study: tasks that do nothing, tiny sheets in earnest, and sleepers on many workers.

    python benchmarks/study_overhead.py [--tasks 20000] [--sleepers 100] [--sheets 2000]

prints the time of each task beyond its work. Sleepers are workers in one process, which shows what the
scheduler and the client take, not what as many machines give.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from studies import Factor, Study
from studies.run import local_cluster, run
from studies.store import Store

FIGURES = {"done": bool}
TASK = "sleeping:sleep"


def timed(study, call, client, figures):
    with tempfile.TemporaryDirectory() as folder, Store(Path(folder), study, figures, "1") as store:
        run(Study("warm", (*study.factors[:-1], Factor(study.factors[-1].name, (0,)))), call, store, client)
        begin = time.perf_counter()
        run(study, call, store, client)
        wall = time.perf_counter() - begin
        store.flush()
        from studies.store import load

        return wall, sum(load(Path(folder))["seconds"].to_pylist())


def main():
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--tasks", type=int, default=20_000)
    asked.add_argument("--sleepers", type=int, default=100)
    asked.add_argument("--sheets", type=int, default=2000)
    words = asked.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{cores} cores\n\n| what | tasks | workers | wall, s | work, s | beyond it, ms a task |")
    print("|---" * 6 + "|")

    def row(what, tasks, workers, wall, work):
        beyond = 1000 * (wall - work / workers) / tasks
        print(f"| {what} | {tasks} | {workers} | {wall:.1f} | {work:.1f} | {beyond:.3f} |", flush=True)

    with local_cluster(cores, 1500) as client:
        client.run(sys.path.append, str(Path(__file__).parent))
        nothing = Study("nothing", (Factor("ms", (0.0,)), Factor("k", tuple(range(words.tasks)))))
        row("nothing", words.tasks, cores, *timed(nothing, TASK, client, FIGURES))
        from vslice.experiment import CALL
        from vslice.experiment import FIGURES as SHEETS

        tiny = Study(
            "tiny",
            (Factor("tiles", ("2x2",)), Factor("method", ("greedy",)), Factor("machine", ("paper",)),
             Factor("objective", ("straight",)), Factor("sheet", tuple(range(words.sheets)))),
        )  # fmt: skip
        row("2x2 sheets, greedy", words.sheets, cores, *timed(tiny, CALL, client, SHEETS))
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=words.sleepers, threads_per_worker=1, processes=False, dashboard_address=None
        ) as many,
        Client(many) as client,
    ):
        tasks = 20 * words.sleepers
        sleepers = Study("sleepers", (Factor("ms", (500.0,)), Factor("k", tuple(range(tasks)))))
        row("sleep 0.5 s", tasks, words.sleepers, *timed(sleepers, TASK, client, FIGURES))


if __name__ == "__main__":
    main()
