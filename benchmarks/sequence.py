"""Measure the sequencer on reference instances, tissue grids and random walks: a table in Markdown on stdout.

usage: python benchmarks/sequence.py [--effort default] [--method auto] [--seeds 10] [--sizes 20 40]
           [--walks 4x4:5 6x6:3] [--only NAMES] [--json FILE] [--objective straight] [--profile paper]
           [--nozzle 25G] [--tile-mm 4]

Each row is an instance, in a process of its own, so that its peak memory is its own: medians over all seeds
of travel, bound, the gap between the two of each run, and processor seconds. Small parts of the instance are
ordered before, which loads the code; a process before the first one compiles what is not compiled yet.

With another ``--objective`` than straight travel, costs and bounds are its own, on the machine of
``--profile`` with a nozzle that is a point. With ``--nozzle`` it is that nozzle, and the problem is the one
that ``vslice slice`` orders: what stands in its way is printed later, or cut into pieces that count as
toolpaths; a sheet with a first toolpath begins at its lower end, if the nozzle can; hops that the profile
extrudes count as extruded. Cutting is not timed. Sheets have tiles of 1 mm, or as wide as ``--tile-mm`` says,
all else in proportion.

Sheets of ``--sizes`` tiles a side follow the source paper's random walk. ``--walks 4x4:5`` adds those of
seeds 1 to 5, and a table of how many of them were proved optimal in every run, and the slowest of all runs.
"""

import argparse
import json
import math
import re
import statistics
import subprocess
import sys
import time
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, get_args

import numpy as np
from instances import Instance, Setting, instance_of, sheets, walk, walk_name
from machine import machine, peak_mb

import profiles
from profiles import ProfileError
from profiles.nozzles import nozzle_called
from slicer.sequence import Problem, solve
from slicer.sequence.problem import ObjectiveName
from vslice.objective import objective_of

HEADINGS = (
    "instance", "toolpaths", "median", "best", "median / n", "bound", "gap", "proved", "seconds", "peak MB",
)  # fmt: skip
PARTS = (60, 300)
"""Toolpaths of the parts whose ordering calls all that ordering the whole will call."""

Row = dict[str, Any]


def walks_of(text: str) -> tuple[int, int, int]:
    """Columns, rows and number of walks of an option such as 4x4:5."""
    match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*):([1-9]\d*)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' must be COLSxROWS:WALKS, as 4x4:5")
    return int(match[1]), int(match[2]), int(match[3])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--effort", default="default")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--objective", choices=get_args(ObjectiveName), default="straight")
    parser.add_argument("--profile", default="paper", help="whose machine it is, for routed travel and time")
    parser.add_argument("--nozzle", metavar="NAME", help="such as 25G, as of 'vslice slice'; else a point")
    parser.add_argument("--tile-mm", type=float, metavar="MM", help="width of a tile; else 1")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--sizes", type=int, nargs="*", default=[])
    parser.add_argument("--walks", type=walks_of, nargs="*", default=[], metavar="COLSxROWS:WALKS")
    parser.add_argument("--only", default="*", help="names of instances, with wildcards")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and every run there too")
    parser.add_argument("--one", metavar="NAME", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.seeds < 1:
        parser.error(f"--seeds {options.seeds} must be at least 1")
    if options.json is not None and (options.json.is_dir() or not options.json.parent.is_dir()):
        parser.error(f"--json {options.json}: name a file in a folder that exists")
    if options.tile_mm is not None and not 0.001 <= options.tile_mm <= 1000:
        parser.error(f"--tile-mm {options.tile_mm:g} must be within 0.001 and 1000")
    try:
        goal = objective_of(profiles.load(options.profile), options.objective)
        if options.nozzle is not None:
            nozzle_called(options.nozzle)
    except ProfileError as error:
        parser.error(str(error))
    setting = Setting(options.objective, options.profile, options.nozzle, options.tile_mm)
    known = sheets(options.sizes, options.walks)
    if options.one is not None:
        if options.one in known:
            print(json.dumps(measure(instance_of(known[options.one](), setting), options)))
        else:
            load(instance_of(walk(6, 6, 1), setting), options.method)
        return
    names = [name for name in known if fnmatch(name, options.only)]
    about = machine()
    print(", ".join(f"{key} {value}" for key, value in about.items()))
    extra = "" if options.tile_mm is None else f", tiles of {options.tile_mm:g} mm"
    if options.nozzle is not None:
        extra = f", {options.profile} with {options.nozzle}{extra}"
    print(
        f"{goal.name} in {goal.unit}, method {options.method}, effort {options.effort}, "
        f"medians of {options.seeds} seeds{extra}\n"
    )
    print("| " + " | ".join(HEADINGS) + " |\n" + "|---" * len(HEADINGS) + "|", flush=True)
    rows: dict[str, Row] = {}
    if names:
        in_own_process("")
    for name in names:
        rows[name] = json.loads(in_own_process(name))
        print("| " + " | ".join([name, *cells(rows[name])]) + " |", flush=True)
    if options.walks:
        print("\n" + table_of_walks(options.walks, rows))
    if options.json is not None:
        asked = ("objective", "profile", "method", "effort", "seeds")
        settings = {name: getattr(options, name) for name in asked}
        for name in ("nozzle", "tile_mm"):
            if getattr(options, name) is not None:
                settings[name] = getattr(options, name)
        whole = {"machine": about, "settings": settings, "instances": rows}
        options.json.write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")


def in_own_process(name: str) -> str:
    """Run this script for one instance; "" only compiles."""
    command = [sys.executable, *sys.argv, "--one", name]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def load(instance: Instance, method: str) -> None:
    """Load the code, or compile it: order parts of a sheet that are closed downwards, as greedy prints it."""
    problem = instance.problem
    order = solve(problem, method="greedy").order
    for toolpaths in PARTS:
        part = Problem.build(
            problem.segments[np.sort(order[:toolpaths])],
            body=problem.body,
            downhill_deg=instance.downhill_deg,
        )
        solve(part, method=method, objective=instance.objective, effort="quick")


def measure(instance: Instance, options: argparse.Namespace) -> Row:
    """Every run of one instance, and the most memory that this process ever had."""
    load(instance, options.method)
    problem, goal = instance.problem, instance.objective
    row: Row = {"toolpaths": problem.n, "cost": [], "bound": [], "proved": [], "seconds": []}
    for seed in range(options.seeds):
        begin = time.process_time()
        result = solve(problem, method=options.method, objective=goal, effort=options.effort, seed=seed)
        row["seconds"].append(time.process_time() - begin)
        row["cost"].append(result.cost)
        row["bound"].append(result.lower_bound)
        row["proved"].append(result.proved)
    return row | {"peak_mb": peak_mb()}


def cells(row: Row) -> list[str]:
    """What a row of the table holds after the name of the instance; nothing where there is no bound."""
    median, seeds = statistics.median(row["cost"]), len(row["cost"])
    bounds = [math.nan if bound is None else bound for bound in row["bound"]]
    gaps = [
        100 * (cost - bound) / bound if bound > 0 else 0.0 if cost == bound else math.inf
        for cost, bound in zip(row["cost"], bounds, strict=True)
    ]
    bound, gap = "", ""
    if not any(map(math.isnan, bounds)):
        bound, gap = f"{statistics.median(bounds):.3f}", f"{statistics.median(gaps):.2f} %"
    return [
        str(row["toolpaths"]),
        f"{median:.3f}",
        f"{min(row['cost']):.3f}",
        f"{median / row['toolpaths']:.4f}",
        bound,
        gap,
        f"{sum(row['proved'])} of {seeds}",
        f"{statistics.median(row['seconds']):.2f}",
        f"{row['peak_mb']:.0f}",
    ]


def table_of_walks(walks: list[tuple[int, int, int]], rows: dict[str, Row]) -> str:
    """How many walks of each size were proved in all of their runs, the slowest run, and the most memory."""
    lines = ["| random walks | proved | slowest run, s | peak MB |", "|---|---|---|---|"]
    for cols, tiles_up, count in walks:
        names = [walk_name(cols, tiles_up, seed) for seed in range(1, count + 1)]
        same = [rows[name] for name in names if name in rows]
        if same:
            proved = sum(all(row["proved"]) for row in same)
            slowest = max(max(row["seconds"]) for row in same)
            memory = max(row["peak_mb"] for row in same)
            lines.append(f"| {cols}x{tiles_up} | {proved} of {len(same)} | {slowest:.2f} | {memory:.0f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
