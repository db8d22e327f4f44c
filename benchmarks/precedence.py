"""Time and memory of the precedence under a nozzle's body, for random walks of several sizes.

usage: python benchmarks/precedence.py [--runs 3] [--sizes 20 40 100]

Tiles are 4 mm wide and lines 0.4 mm apart; half of that may press into the body. Every run is a process of
its own, so that peak memory belongs to one size and nozzle; what it compiles is done before the clock starts.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time

from machine import machine, peak_mb

TILE_MM, SPACING_MM = 4.0, 0.4
NOZZLES = {
    "point": (0.0, 0.0, 1.0, 0.0),
    "25G": (0.51, 0.0, 12.7, 4.0),
    "25G, cone 8": (0.51, 8.0, 12.7, 8.0),
    "cone 30": (1.0, 30.0, 5.0, 16.0),
    "cone 45": (1.0, 45.0, 5.0, 16.0),
}
"""Width of the tip, cone in degrees, length and width of the shoulder, in mm."""


def measure(size: int, nozzle: str) -> dict[str, float]:
    """Seconds of all precedence of ``size`` x ``size`` tiles, toolpaths, edges a toolpath, peak MB."""
    from slicer import generate
    from slicer.hatch import hatch
    from slicer.nozzle import NozzleBody
    from slicer.precedence import hindering_edges

    body = NozzleBody.of(*NOZZLES[nozzle], SPACING_MM / 2)
    found: dict[str, float] = {}
    for cols in (2, size):
        field = generate.random_walk(cols, cols, seed=1, tile_mm=TILE_MM, spacing_mm=SPACING_MM)
        segments = hatch(field).segments
        begin = time.perf_counter()
        edges = hindering_edges(segments, body)
        seconds = time.perf_counter() - begin
        found = {"seconds": seconds, "toolpaths": len(segments), "edges": len(edges) / len(segments)}
    return found | {"peak MB": peak_mb()}


def main() -> None:
    """Run all sizes and nozzles in processes of their own and print the table of medians."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--sizes", type=int, nargs="+", default=[20, 40, 100])
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(int(arguments.one[0]), arguments.one[1])))
        return

    def run(size: int, nozzle: str) -> dict[str, float]:
        command = [sys.executable, __file__, "--one", str(size), nozzle]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        found: dict[str, float] = json.loads(done.stdout)
        return found

    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    print(f"medians of {arguments.runs} runs\n")
    print("| tiles | toolpaths | nozzle | seconds | edges a toolpath | peak MB |\n|---|---|---|---|---|---|")
    for size in arguments.sizes:
        for nozzle in NOZZLES:
            rows = [run(size, nozzle) for _ in range(arguments.runs)]
            median = {key: statistics.median(row[key] for row in rows) for key in rows[0]}
            print(
                f"| {size}x{size} | {median['toolpaths']:.0f} | {nozzle} | {median['seconds']:.2f} | "
                f"{median['edges']:.2f} | {median['peak MB']:.0f} |"
            )


if __name__ == "__main__":
    main()
