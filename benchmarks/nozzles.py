"""How the examples print with real nozzles: a Markdown table of pieces, presses, travel, time and gap.

usage: python benchmarks/nozzles.py [--examples FILE ...] [--nozzles point 32G ...] [--objective time]

Every run is a process of its own. Columns: toolpaths as hatched and as cut, the cuts that no way of printing
can do without, how deep the printed pushes into the nozzle by the check's own model, straight travel J, the
estimated time of all travels and of the print, the gap of what is minimised, and processor seconds and memory
of the run.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

from machine import machine

ROOT = Path(__file__).parents[1]
EXAMPLES = ["muscle_us_8x8", "ihc_8x8", "dti_small_101D_sagittal_10x10", "ihc_16x16"]
NOZZLES = ["point", "32G", "27G", "25G", "brass-0.4"]
HEADS = [
    "sheet", "nozzle", "toolpaths", "pieces", "cuts at least", "presses [mm]", "J [mm]", "travel [s]",
    "print [s]", "gap", "s", "MB",
]  # fmt: skip


def settings_of(nozzle: str) -> list[str]:
    """What a nozzle changes in a profile; a point has no width."""
    from profiles.nozzles import nozzle_called

    return ["nozzle.tip_width_mm=0"] if nozzle == "point" else nozzle_called(nozzle).settings()


def measure(grid: Path, nozzle: str, profile: str, effort: str, objective: str) -> list[str]:
    """A row of the table, but for the name of the sheet."""
    from vslice.pipeline import Search, slice_grid

    begin = time.process_time()
    search = Search(effort=effort, objective=objective)
    done = slice_grid(grid, profile, tuple(settings_of(nozzle)), search=search, step=lambda _: None)
    seconds = time.process_time() - begin
    deepest = None if done.pressing is None else done.pressing.deepest
    gap, cut = done.result.gap, done.printable.cut
    return [
        nozzle,
        str(done.printable.hatch_lines),
        str(len(done.lines.segments)),
        "-" if cut is None else str(cut.fewest),
        "-" if deepest is None else f"{deepest.depth_mm:.3f}",
        f"{done.result.travel_mm:.1f}",
        f"{done.program.times.travel_s:.1f}",
        f"{done.program.times.total_s:.0f}",
        "-" if gap is None else "proved" if done.result.proved else f"{100 * gap:.1f} %",
        f"{seconds:.0f}",
        f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f}",
    ]


def main() -> None:
    """Run every sheet with every nozzle and print rows as they come."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--examples", nargs="+", default=[f"examples/{name}.json" for name in EXAMPLES])
    parser.add_argument("--nozzles", nargs="+", default=NOZZLES)
    parser.add_argument("--profile", default="marlin-syringe", help="The machine that they are put on.")
    parser.add_argument("--effort", default="default")
    parser.add_argument("--objective", default="time")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    grids = [ROOT / name for name in asked.examples]
    if asked.one:
        print(json.dumps(measure(grids[0], asked.nozzles[0], asked.profile, asked.effort, asked.objective)))
        return
    print(", ".join(machine().values()))
    print(f"{asked.profile}, effort {asked.effort}, objective {asked.objective}; s include imports\n")
    print(f"| {' | '.join(HEADS)} |\n|{'---|' * len(HEADS)}")
    for grid in grids:
        for nozzle in asked.nozzles:
            command = [sys.executable, __file__, "--one", "--examples", str(grid), "--nozzles", nozzle]
            command += ["--profile", asked.profile, "--effort", asked.effort, "--objective", asked.objective]
            run = subprocess.run(command, capture_output=True, text=True, check=False)
            row = json.loads(run.stdout) if run.returncode == 0 else [nozzle, run.stderr.strip()[-200:]]
            print(f"| {grid.stem} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
