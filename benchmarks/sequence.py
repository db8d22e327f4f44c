"""Measure the sequencer on reference instances and tissue grids: a table in Markdown on stdout.

usage: python benchmarks/sequence.py [--effort default] [--method auto] [--seeds 10] [--sizes 20 40]
           [--peers PYTHON [--peer-seconds 30]]

Each row is the median of all seeds, in one process, after one run that compiles. Seconds are those of the
processor. Sheets of ``--sizes`` tiles a side follow the source paper's random walk.

``--peers`` names an interpreter that has numpy, ortools and didppy, in an environment of their own. A second
table then shows what these solvers find on reference instances, one run each, from our greedy order where
they can start from one. Every order is checked and measured by us, not by its solver.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
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

PEERS = {"OR-Tools routing": "routing.py", "OR-Tools CP-SAT": "cp_sat.py", "DIDPPy CABS": "dynamic.py"}
PEER_INSTANCES = ("2x2_s1", "3x3_s1", "4x4_s1", "10x10_s1")


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
    parser.add_argument("--peers", metavar="PYTHON", help="interpreter that has the peers installed")
    parser.add_argument("--peer-seconds", type=float, default=30.0, help="time limit of each peer's solver")
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
    if options.peers:
        compare_peers(options.peers, options.peer_seconds)


def compare_peers(python: str, limit_s: float) -> None:
    """Run each peer on each instance of ``PEER_INSTANCES``, in a process of its own, and print a table."""
    known = dict(instances([]))
    missing: dict[str, str] = {}
    print(f"\nPeers, {limit_s:g} s each:\n")
    print("| instance | method | J | bound | proved | seconds |")
    print("|---|---|---|---|---|---|")
    for name in PEER_INSTANCES:
        for peer, script in PEERS.items():
            if peer not in missing:
                outcome = peer_row(python, script, known[name], limit_s)
                if outcome.startswith(("ModuleNotFoundError", "no interpreter")):
                    missing[peer] = outcome
                else:
                    print(f"| {name} | {peer} {outcome} |", flush=True)
    for peer, reason in missing.items():
        print(f"\n{peer} skipped: {reason}")


def peer_row(python: str, script: str, problem: Problem, limit_s: float) -> str:
    """Version and the cells after it of one run; or why there are none."""
    start = solve(problem, method="greedy")
    task = {
        "segments": problem.segments.tolist(),
        "edges": problem.edges.tolist(),
        "first": problem.first,
        "time_limit_s": limit_s,
        "initial": [[int(s), bool(f)] for s, f in zip(start.order, start.flipped, strict=True)],
    }
    try:
        run = subprocess.run(
            [python, str(ROOT / "benchmarks" / "peers" / script)],
            input=json.dumps(task),
            capture_output=True,
            text=True,
            timeout=3 * limit_s + 120,  # reading and making the model is not in the solver's limit
            env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        )
    except OSError as error:
        return f"no interpreter {python} ({error.strerror})"
    except subprocess.TimeoutExpired:
        return "| not ended in time | | | "
    if run.returncode:
        lines = run.stderr.strip().splitlines() or [f"ended with {run.returncode}"]
        return lines[-1] if lines[-1].startswith("ModuleNotFoundError") else f"| {lines[-1]} | | | "
    answer = json.loads(run.stdout)
    travel = "nothing found"
    if answer["order"] is not None:
        order = np.array([s for s, _ in answer["order"]], np.int64)
        refused = problem.refusal(order)
        if refused is None:
            travel = f"{problem.travel_mm(order, [f for _, f in answer['order']]):.3f}"
        else:
            travel = f"invalid: {refused}"
    bound = "" if answer["bound"] is None else f"{answer['bound']:.3f}"
    proved = "yes" if answer["proved"] else "no"
    return f"{answer['version']} | {travel} | {bound} | {proved} | {answer['seconds']:.1f}"


if __name__ == "__main__":
    main()
