"""How long commands take that order no toolpaths: whole processes, and what heavy packages they import.

usage: python benchmarks/startup.py PART.gcode GRID.json [--runs 9] [--only NAME ...]

PART.gcode is a program that vslice made of GRID.json. Medians of wall seconds from the start of the
interpreter to its end, after one run of each that is not counted.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import machine

HEAVY = ("numba", "llvmlite", "scipy", "matplotlib", "shapely")
RUN = "import sys; from vslice.cli import main; main(sys.argv[1:])"
TOLD = f"""
import atexit, sys
atexit.register(lambda: print("imported", *({HEAVY!r} & sys.modules.keys()), file=sys.stderr))
{RUN}
""".replace(repr(HEAVY), repr(set(HEAVY)))


def commands(part: str, grid: str, picture: str) -> dict[str, list[str]]:
    """The command lines that are measured, by name."""
    return {
        "--help": ["--help"],
        "check --help": ["check", "--help"],
        "send --help": ["send", "--help"],
        "ports": ["ports"],
        "profiles": ["profiles"],
        "profiles schema": ["profiles", "schema"],
        "grid-schema": ["grid-schema"],
        "generate": ["generate"],
        "console --help": ["console", "--help"],
        "emulate --help": ["emulate", "--help"],
        "check": ["check", part],
        "check --grid": ["check", part, "--grid", grid],
        "send --dry-run": ["send", part, "--dry-run"],
        "preview of no file": ["preview", "there-is-none.gcode"],  # its start, before it draws
        "preview of a program": ["preview", part, "-o", picture],
        "preview of a grid": ["preview", grid, "-o", picture],
    }


def imported(words: list[str]) -> str:
    """Which heavy packages a command imports."""
    done = subprocess.run([sys.executable, "-c", TOLD, *words], capture_output=True, text=True, check=False)
    line = next(line for line in done.stderr.splitlines() if line.startswith("imported"))
    return ", ".join(sorted(line.split()[1:])) or "none"


def seconds(words: list[str], fails: bool) -> float:
    """Wall seconds of one process.

    Raises:
        SystemExit: the command failed, or did not where it should.
    """
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", RUN, *words], capture_output=True, check=False)
    took = time.perf_counter() - begin
    if bool(done.returncode) != fails:
        raise SystemExit(f"vslice {' '.join(words)}: {done.stderr.decode()}")
    return took


def main() -> None:
    """Print a table of medians."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part")
    parser.add_argument("grid")
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    arguments = parser.parse_args()
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    print(f"medians of {arguments.runs} runs\n\n| command | seconds | heavy packages |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        every = commands(arguments.part, arguments.grid, str(Path(folder, "picture.png")))
        for name, words in every.items():
            if arguments.only and name not in arguments.only:
                continue
            heavy = imported(words)  # and warms the files
            median = statistics.median(
                seconds(words, name.endswith("of no file")) for _ in range(arguments.runs)
            )
            print(f"| `{name}` | {median:.2f} | {heavy} |", flush=True)


if __name__ == "__main__":
    main()
