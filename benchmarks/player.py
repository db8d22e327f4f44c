"""Frames per second of the player, time to load, and size of its page, in a headless browser.

usage: python benchmarks/player.py [--tiles 100] [--chromium /usr/bin/chromium] [--seconds 5]

The sheet has TILES x TILES tiles of 1 mm with random tilts and 12 lines each, in rows of tiles: 120,000
toolpaths with the default. The browser draws in software (SwiftShader), as on a machine without any graphics
card. Beside the frames per second of a machine that may be busy with other things it tells what a frame
costs: processor time of all processes of the browser.
"""

import argparse
import gzip
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from machine import machine

SOFTWARE = ("--no-sandbox", "--enable-unsafe-swiftshader")


def program_text(tiles: int) -> str:
    """G-code of a sheet of tiles x tiles, laid in rows of tiles, at most 10 mm/s apart from travels."""
    import profiles
    from gcode import emit, program
    from slicer.grid import Grid
    from slicer.hatch import hatch
    from slicer.travel import Plan, straight_mm

    angles = np.random.default_rng(1).uniform(-45, 45, (tiles, tiles))
    lines = hatch(Grid(angles, np.full(angles.shape, 1 / 12), (1.0, 1.0)))
    middle = lines.segments.mean(axis=1)
    order = np.lexsort((middle[:, 1] - middle[:, 0] * 1e-9, lines.tile[:, 0], lines.tile[:, 1]))
    toolpaths = lines.segments[order]
    toolpaths[1::2] = toolpaths[1::2, ::-1].copy()
    n = len(order)
    length = straight_mm(toolpaths)
    via, joined = np.zeros(n + 1, np.int64), np.zeros(n, np.bool_)
    plan = Plan(toolpaths, order, np.empty((0, 2)), via, joined, length, length)
    profile = profiles.load("marlin-syringe")
    made = program.lay_out(plan, profile, np.full(n, 1 / 12))
    facts = {"version": "benchmark", "profile": "marlin-syringe", "toolpaths": str(n)}
    return "\n".join(emit.emit(made, profile, facts)) + "\n"


def cpu_seconds(session: int) -> float:
    """Processor time of all processes of a session so far."""
    total = 0.0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                name = (entry / "cmdline").read_text()
            except OSError:
                continue
            if "chromium" in name and f"player-bench-{session}" in (name + _parents(int(entry.name))):
                total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def _parents(pid: int) -> str:
    """The command lines of a process's parents: only the first of a browser's names its folder."""
    names = ""
    for _ in range(6):
        try:
            pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
            names += Path(f"/proc/{pid}/cmdline").read_text()
        except (OSError, ValueError):
            break
    return names


def frames(browser: Any, address: str, seconds: float, plain: bool) -> None:
    """Load the page and play it; tell how it went."""
    opened = browser.new_page()
    begin = time.perf_counter()
    opened.goto(address + ("#plain" if plain else ""))
    opened.wait_for_selector("body[data-ready]", timeout=120_000)
    loaded = time.perf_counter() - begin
    inside = opened.evaluate("performance.now() / 1000")
    print(f"{opened.evaluate('player.panes[0].painter.constructor.name')}: loaded in {loaded:.2f} s "
          f"({inside:.2f} s of them in the page)")  # fmt: skip
    redraw = opened.evaluate(
        "() => { player.seek(player.total); const b = performance.now(); player.panes[0].stale = true;"
        " player.paint(b); const g = player.panes[0].painter.gl; if (g) g.readPixels(0, 0, 1, 1,"
        " g.RGBA, g.UNSIGNED_BYTE, new Uint8Array(4)); return performance.now() - b }"
    )
    print(f"  all of it drawn anew: {redraw:.0f} ms")
    for speed in (1, 100, 1000):
        opened.evaluate(
            f"player.pause(); player.seek(player.total / 3); player.speed = {speed}; player.play()"
        )
        opened.wait_for_timeout(1000)
        opened.evaluate("player.frames = 0; player.spent = 0")
        before, begin = cpu_seconds(os.getpid()), time.perf_counter()
        opened.wait_for_timeout(seconds * 1000)
        count = opened.evaluate("player.frames")
        took = time.perf_counter() - begin
        cost = (cpu_seconds(os.getpid()) - before) / max(count, 1)
        print(f"  at {speed}x: {count / took:.1f} frames a second, {1000 * cost:.1f} ms of processor a frame")
    opened.close()


def main() -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tiles", type=int, default=100)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--seconds", type=float, default=5)
    arguments = parser.parse_args()
    from playwright.sync_api import sync_playwright

    from gcode.player import page, track_of
    from vslice.machine import read_program

    print(", ".join(f"{key} {value}" for key, value in machine().items()), f"load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory(prefix=f"player-bench-{os.getpid()}-") as folder:
        part = Path(folder, "part.gcode")
        text = program_text(arguments.tiles)
        part.write_text(text)
        small = len(gzip.compress(text.encode(), 9))
        moves, _, profile = read_program(part, None, ())
        begin = time.perf_counter()
        track = track_of(moves, profile, name=part.name)
        made = page([track])
        Path(folder, "part.html").write_text(made)
        print(
            f"{track.toolpaths} toolpaths, page made in {time.perf_counter() - begin:.1f} s: "
            f"{len(made.encode()) / 1000:.0f} kB; its G-code {len(text) / 1000:.0f} kB, "
            f"{small / 1000:.0f} kB by gzip -9: at most {2 * small / 1000 + 500:.0f} kB are allowed",
            flush=True,
        )
        with sync_playwright() as play:
            for flags, plain in ((SOFTWARE, False), (("--no-sandbox", "--disable-gpu"), True)):
                browser = play.chromium.launch(
                    executable_path=arguments.chromium,
                    args=[*flags, f"--crash-dumps-dir={folder}/player-bench-{os.getpid()}"],
                )
                frames(browser, Path(folder, "part.html").as_uri(), arguments.seconds, plain)
                browser.close()


if __name__ == "__main__":
    sys.exit(main())
