"""Measure the sequencer on reference instances and tissue grids: a table in Markdown on stdout.

usage: python benchmarks/sequence.py [--effort default] [--method auto] [--seeds 10] [--sizes 20 40]

Each row is the median of all seeds, in one process, after one run that compiles. Seconds are those of the
processor. Sheets of ``--sizes`` tiles a side follow the source paper's random walk.
"""

import argparse
import json
import resource
import statistics
import time
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import numpy as np

from slicer import grid
from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import Problem, solve

ROOT = Path(__file__).parents[1]


def instances(sizes: list[int]) -> Iterator[tuple[str, Problem]]:
    """Name and problem of each instance; reference sheets begin with their first toolpath."""
    for file in sorted((ROOT / "tests" / "data" / "reference").glob("*_s1.json")):
        data = json.loads(file.read_text(encoding="utf-8"))
        yield file.stem, Problem.build(np.array(data["segments"], float), first=data["first"])
    for file in sorted((ROOT / "examples").glob("*.json")):
        yield file.stem, Problem.build(hatch(grid.read(file)).segments, first=None)
    for size in sizes:
        yield f"{size}x{size}", Problem.build(hatch(random_walk(size, size, seed=1)).segments, first=0)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--effort", default="default")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--sizes", type=int, nargs="*", default=[])
    parser.add_argument("--only", default="*", help="names of instances, with wildcards")
    options = parser.parse_args()
    print("| instance | toolpaths | J median | J best | J / n | bound | gap | seconds | peak MB |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, problem in instances(options.sizes):
        if not fnmatch(name, options.only):
            continue
        solve(problem, method=options.method, effort="quick")
        travels, seconds, bounds = [], [], []
        for seed in range(options.seeds):
            begin = time.process_time()
            result = solve(problem, method=options.method, effort=options.effort, seed=seed)
            seconds.append(time.process_time() - begin)
            travels.append(result.travel_mm)
            bounds.append(result.lower_bound_mm or 0.0)
        median, bound = statistics.median(travels), max(bounds)
        gap = f"{100 * (median / bound - 1):.2f} %" if bound else ""
        print(
            f"| {name} | {problem.n} | {median:.3f} | {min(travels):.3f} | {median / problem.n:.4f} "
            f"| {f'{bound:.3f}' if bound else ''} | {gap} | {statistics.median(seconds):.2f} "
            f"| {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
