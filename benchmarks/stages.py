"""What each stage of the search takes, and what the best sequence costs at its end: a table in Markdown.

usage: python benchmarks/stages.py [--objective time] [--profile paper] [--effort default] [--sizes 20]
           [--only NAMES]

A stage is what the progress calls so, under the name of what it ends with; those that come several times are
added up. Seconds are processor seconds, of a second run, which compiles nothing.
"""

import argparse
import time
from fnmatch import fnmatch

from instances import Setting, instance_of, sheets
from machine import machine

from slicer.sequence import solve
from slicer.sequence.problem import Objective, Problem


def stages(problem: Problem, objective: Objective, effort: str) -> tuple[dict[str, tuple[float, float]], str]:
    """Seconds of each stage and the cost that it leaves, by its name; and what the whole came to."""
    found: dict[str, tuple[float, float]] = {}
    since = time.process_time()

    def told(progress) -> None:
        nonlocal since
        now = time.process_time()
        spent, _ = found.get(progress.stage, (0.0, 0.0))
        found[progress.stage] = spent + now - since, progress.cost
        since = now

    result = solve(problem, objective=objective, effort=effort, progress=told)
    bound = "none" if result.lower_bound is None else f"{result.lower_bound:.3f}"
    return found, f"{result.cost:.3f} {result.unit}, at least {bound}"


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--objective", default="time")
    asked.add_argument("--profile", default="paper")
    asked.add_argument("--effort", default="default")
    asked.add_argument("--sizes", nargs="*", type=int, default=[])
    asked.add_argument("--only", default="*")
    words = asked.parse_args()
    print(
        f"{machine()}\n\n| sheet | stages: seconds, then the cost | in the end |\n|---|---|---|", flush=True
    )
    for name, make in sheets(words.sizes, []).items():
        if not fnmatch(name, words.only):
            continue
        instance = instance_of(make(), Setting(objective=words.objective, profile=words.profile))
        for _ in range(2):
            found, whole = stages(instance.problem, instance.objective, words.effort)
        cells = ", ".join(f"{stage} {spent:.1f} s: {cost:.2f}" for stage, (spent, cost) in found.items())
        print(f"| {name} | {cells} | {whole} |", flush=True)


if __name__ == "__main__":
    main()
