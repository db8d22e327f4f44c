"""What the order saves against the source paper's greedy, in both units: a table in Markdown on stdout.

usage: python benchmarks/saved.py [--seeds 3] [--sizes 4 6 10] [--examples NAME ...] [--profile NAME]

For each sheet the default search runs for straight travel (mm) and for time (s), as ``vslice slice`` does it;
shown are medians over the seeds, greedy's figure, the bound where one is known, and processor seconds of the
whole job. Every run is a process of its own; a first one that is not counted compiles what is not compiled.
Sheets of ``--sizes`` tiles a side are those of ``vslice generate --cols N --rows N --seed 1``.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from machine import machine

EXAMPLES = Path(__file__).parents[1] / "tests" / "data" / "tissue"
OBJECTIVES = ("straight", "time")
HEADINGS = ("sheet", "toolpaths", "objective", "greedy", "vslice", "saved", "gap of what is minimised", "s")


def measure(grid_file: Path, objective: str, seed: int, profile: str) -> dict[str, Any]:
    """Slice once: what greedy and the search travel in the objective's unit, and what it took."""
    from vslice.pipeline import Search, slice_grid

    room = ("machine.build_volume_mm=[10000.0,10000.0,10000.0]",)
    search = Search(objective=objective, seed=seed)
    begin = time.process_time()
    sliced = slice_grid(grid_file, profile, room, search=search, step=lambda _: None)
    seconds = time.process_time() - begin
    return {
        "toolpaths": len(sliced.plan.toolpaths),
        "greedy": sliced.greedy,
        "found": sliced.travel,
        "minimised": sliced.result.cost,
        "bound": sliced.result.lower_bound,
        "seconds": seconds,
    }


def row(name: str, grid_file: Path, objective: str, seeds: int, profile: str) -> str:
    """The medians of one sheet and objective, each run in a process of its own."""
    runs = []
    for seed in range(seeds):
        words = [sys.executable, __file__, "--one", str(grid_file), objective, str(seed), profile]
        ended = subprocess.run(words, check=True, capture_output=True, text=True)
        runs.append(json.loads(ended.stdout))
    middle = {key: statistics.median(run[key] for run in runs) for key in ("found", "minimised", "seconds")}
    bounds = [run["bound"] for run in runs if run["bound"] is not None]
    known = (
        "" if len(bounds) < seeds else f"{100 * (1 - statistics.median(bounds) / middle['minimised']):.1f} %"
    )
    unit = "s" if objective == "time" else "mm"
    greedy, found = runs[0]["greedy"], middle["found"]
    cells = (
        name, runs[0]["toolpaths"], objective, f"{greedy:.1f} {unit}", f"{found:.1f} {unit}",
        f"{100 * (1 - found / greedy):.0f} %", known, f"{middle['seconds']:.0f}",
    )  # fmt: skip
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Measure all sheets and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sizes", type=int, nargs="*", default=[4, 6, 10])
    parser.add_argument(
        "--examples", nargs="*", default=sorted(path.stem for path in EXAMPLES.glob("*.json"))
    )
    parser.add_argument("--profile", default="paper")
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        grid_file, objective, seed, profile = arguments.one
        print(json.dumps(measure(Path(grid_file), objective, int(seed), profile)))
        return
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    print(f"profile {arguments.profile}, method auto, effort default, medians of {arguments.seeds} seeds\n")
    print(f"| {' | '.join(HEADINGS)} |")
    print("|---" * len(HEADINGS) + "|")
    with tempfile.TemporaryDirectory() as folder:
        from slicer import generate, grid

        sheets = {}
        for size in arguments.sizes:
            sheets[f"{size}x{size}"] = Path(folder, f"{size}.json")
            sheets[f"{size}x{size}"].write_text(grid.dumps(generate.random_walk(size, size, seed=1)))
        sheets |= {name: EXAMPLES / f"{name}.json" for name in arguments.examples}
        for objective in OBJECTIVES:  # what is compiled by a first run takes no time of the others
            measure(next(iter(sheets.values())), objective, 0, arguments.profile)
        for name, file in sheets.items():
            for objective in OBJECTIVES:
                print(row(name, file, objective, arguments.seeds, arguments.profile), flush=True)


if __name__ == "__main__":
    main()
