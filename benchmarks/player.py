"""Frames per second of the player, time to load, and size of its page, in a headless browser.

usage: python benchmarks/player.py [--tiles 92] [--chromium /usr/bin/chromium] [--seconds 3] [--repeat 5]

The sheet has TILES x TILES tiles of 1 mm with random tilts and 12 lines each, in rows of tiles: 121,936
toolpaths with the default. The browser draws in software, as on a machine without any graphics card: first as
the page chooses then, and by WebGL2 (SwiftShader) as well. Beside the frames per second of a machine that may
be busy with other things it tells what a frame costs: processor time of all processes of the browser.
"""

import argparse
import gzip
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
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


WHOLE = """() => new Promise((done) => {
  const next = () => window.player?.whole ? done(performance.now() / 1000) : setTimeout(next, 5);
  next();
})"""
"""How long it took until all of what was asked for is drawn, in seconds since the page was opened."""


def load(browser: Any, address: str) -> tuple[Any, float, float]:
    """The page, how many seconds it took from opening it to the whole picture, and seconds of processor."""
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    before, begin = cpu_seconds(os.getpid()), time.perf_counter()
    opened.goto(address, wait_until="commit")
    opened.wait_for_selector("body[data-ready]", timeout=120_000)
    opened.evaluate(WHOLE)
    if opened.evaluate("player.panes[0].painter.gl !== undefined"):  # it has been asked for, no more
        opened.evaluate(
            "() => { const g = player.panes[0].painter.gl;"
            " g.readPixels(0, 0, 1, 1, g.RGBA, g.UNSIGNED_BYTE, new Uint8Array(4)); }"
        )
    return opened, time.perf_counter() - begin, cpu_seconds(os.getpid()) - before


def told(values: list[float], unit: str, digits: int, best: Any = min) -> str:
    """The best and the median of several runs."""
    return f"best {best(values):.{digits}f}, median {statistics.median(values):.{digits}f} {unit}"


def seek(opened: Any, share: float) -> float:
    """Seconds until a moment is drawn, in JavaScript and behind it."""
    seconds: float = opened.evaluate(
        "async (share) => { const begin = performance.now(); player.seek(player.total * share);"
        f" await ({WHOLE})(); const g = player.panes[0].painter.gl; if (g) g.readPixels(0, 0, 1, 1,"
        " g.RGBA, g.UNSIGNED_BYTE, new Uint8Array(4)); return (performance.now() - begin) / 1000 }",
        share,
    )
    return seconds


def frames(start: Callable[[], Any], address: str, seconds: float, repeat: int) -> None:
    """Load the page anew several times and play it; tell how it went."""
    loads, works, forth, back = [], [], [], []
    played: dict[int, list[float]] = {1: [], 100: [], 1000: []}
    cost: dict[int, list[float]] = {speed: [] for speed in played}
    painter = ""
    for _ in range(repeat):
        browser = start()
        opened, loaded, work = load(browser, address)
        loads.append(loaded)
        works.append(work)
        painter = opened.evaluate("player.panes[0].painter.constructor.name")
        forth.append(seek(opened, 1.0))
        back.append(seek(opened, 0.33))
        for speed in played:
            opened.evaluate(
                f"player.pause(); player.seek(player.total / 3); player.speed = {speed}; player.play()"
            )
            opened.wait_for_timeout(1000)
            before, begin = cpu_seconds(os.getpid()), time.perf_counter()
            first = opened.evaluate("player.frames")
            opened.wait_for_timeout(seconds * 1000)
            count = opened.evaluate("player.frames") - first
            played[speed].append(count / (time.perf_counter() - begin))
            cost[speed].append(1000 * (cpu_seconds(os.getpid()) - before) / max(count, 1))
        browser.close()
    print(f"{painter}, {repeat} runs, load {os.getloadavg()[0]:.1f}")
    print(f"  from opening to the whole picture: {told(loads, 's', 2)}; {told(works, 's of processor', 2)}")
    print(f"  to the end: {told(forth, 's', 2)}; back to a third: {told(back, 's', 2)}")
    for speed, rates in played.items():
        print(
            f"  at {speed}x: {told(rates, 'frames a second', 1, max)}; "
            f"{statistics.median(cost[speed]):.1f} ms of processor a frame",
            flush=True,
        )


def main() -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tiles", type=int, default=92)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--seconds", type=float, default=3)
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

            def start() -> Any:
                return play.chromium.launch(
                    executable_path=arguments.chromium,
                    args=[*SOFTWARE, f"--crash-dumps-dir={folder}/player-bench-{os.getpid()}"],
                )

            for mark in ("", "#webgl"):
                frames(start, Path(folder, "part.html").as_uri() + mark, arguments.seconds, arguments.repeat)


if __name__ == "__main__":
    sys.exit(main())
