"""Time and memory of the main job, stage by stage: grid.json to part.gcode, and its check.

usage: python benchmarks/slice.py [--runs 3] [--sizes 10 40 100]

Every run is a process of its own, so that peak memory belongs to one size. A first run of the smallest
size is not counted: it compiles what is not compiled yet.
"""

import argparse
import json
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import date
from importlib.metadata import version
from pathlib import Path

STAGES = ["load", "hatch", "precedence", "greedy", "routing", "emit", "estimate", "check"]
"""The estimate is part of emitting too, where it is made for the head."""


def measure(size: int) -> dict[str, float]:
    """Seconds of each stage for a random walk of ``size`` x ``size`` tiles, toolpaths, peak MB."""
    import gcode.check
    import profiles
    from gcode import emit, estimate, program
    from gcode.written import seconds_as_read
    from slicer import generate, grid, hatch, sequence, travel

    # All that compiles or imports is done once on a small sheet before the clock starts.
    profile = profiles.load(
        "paper", ["machine.build_volume_mm=[10000.0,10000.0,10000.0]", "machine.offset_mm=10.0"]
    )
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        grid_file, part_file = Path(folder, "grid.json"), Path(folder, "part.gcode")
        for cols in (2, size):
            grid_file.write_text(grid.dumps(generate.random_walk(cols, cols, seed=1)))
            marks = [time.perf_counter()]
            sheet = grid.read(grid_file)
            marks.append(time.perf_counter())
            lines = hatch.hatch(sheet)
            marks.append(time.perf_counter())
            problem = sequence.Problem.build(lines.segments, first=0)
            marks.append(time.perf_counter())
            result = sequence.solve(problem, method="greedy")
            marks.append(time.perf_counter())
            plan = travel.plan(lines.segments, result.order, result.flipped, clearance_mm=0.2)
            marks.append(time.perf_counter())
            tile = lines.tile[result.order]
            made = program.build(plan, profile, sheet.spacing_mm[tile[:, 1], tile[:, 0]], tile)
            part_file.write_text("\n".join(emit.emit(made, profile, {})))
            marks.append(time.perf_counter())
            estimate.times_of(made.moves, seconds_as_read(made.moves, profile))
            marks.append(time.perf_counter())
            report = gcode.check.check_file(part_file, profile, sheet)
            marks.append(time.perf_counter())
            if report.violations:
                raise SystemExit(f"{size} x {size}: {report.violations[0]}")
            seconds = {name: b - a for name, a, b in zip(STAGES, marks, marks[1:], strict=False)}
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return seconds | {"toolpaths": len(lines.segments), "peak MB": peak_mb}


def main() -> None:
    """Run all sizes in processes of their own and print the table of medians."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--sizes", type=int, nargs="+", default=[10, 40, 100])
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(arguments.one)))
        return

    def run(size: int) -> dict[str, float]:
        command = [sys.executable, __file__, "--one", str(size)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        found: dict[str, float] = json.loads(done.stdout)
        return found

    run(min(arguments.sizes))
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "shapely", "numba"))
    print(f"{date.today()}, {platform.machine()}, Python {platform.python_version()}, {packages}")
    print(f"medians of {arguments.runs} runs, seconds\n")
    print("| tiles | toolpaths | " + " | ".join(STAGES) + " | sum | sum without check | peak MB |")
    print("|---" * (len(STAGES) + 5) + "|")
    for size in arguments.sizes:
        rows = [run(size) for _ in range(arguments.runs)]
        median = {key: statistics.median(row[key] for row in rows) for key in rows[0]}
        total = sum(median[stage] for stage in STAGES)
        cells = [f"{median[stage]:.2f}" for stage in STAGES]
        print(
            f"| {size}x{size} | {median['toolpaths']:.0f} | {' | '.join(cells)} | {total:.2f} | "
            f"{total - median['check']:.2f} | {median['peak MB']:.0f} |"
        )


if __name__ == "__main__":
    main()
