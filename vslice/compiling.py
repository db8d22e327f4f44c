"""Machine code before it is needed: what the installation compiles, and what a first run without it does."""

import multiprocessing
import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def compiling() -> Iterator[bool]:
    """Let a second process compile what a job needs last, while the job compiles what it needs first.

    Machine code is kept on disk, so either process finds what the other has compiled. Yields whether
    anything has to be compiled.
    """
    from slicer.kernels import is_kept
    from slicer.sweep import sweep

    if is_kept(sweep):  # the first kernel of every job
        yield False
        return
    helper = multiprocessing.get_context("spawn").Process(target=compile_the_rest, daemon=True)
    helper.start()
    try:
        yield True
    finally:
        helper.terminate()
        helper.join()


def compile_the_rest() -> None:
    """Run the bound, refinement and the routing of travels on six toolpaths, and so compile them.

    To be called in a process of its own, which the caller ends.
    """
    import numpy as np

    from slicer import travel
    from slicer.processes import end_with_parent
    from slicer.sequence.portfolio import rehearse

    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the job hears of Ctrl-C, and ends this
    rehearse()
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    travel.plan(segments, np.arange(6), np.zeros(6, np.bool_), clearance_mm=0.2)


def compile_kernels() -> None:
    """Order small sheets of every kind by the default way, and so compile what it runs."""
    import numpy as np

    from slicer import hatch, sequence, travel
    from slicer.grid import Grid
    from slicer.nozzle import POINT, NozzleBody
    from slicer.sequence.problem import Objective
    from vslice.printable import printable

    random = np.random.default_rng(1)
    goal = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)
    needle, cone = NozzleBody.of(0.2, 0.0, 5.0, 4.0, 0.1), NozzleBody.of(0.3, 30.0, 5.0, 6.0, 0.06)
    # Proved; searched only; and so steep that its down-sets are too many, or that it has to be cut.
    kinds = (
        (2, 0.2, -45.0, 0.0, "default", POINT),
        (4, 0.12, -45.0, 0.0, "default", POINT),
        (6, 0.12, -85.0, 85.0, "quick", POINT),
        (3, 0.2, -45.0, 0.0, "default", needle),
        (3, 0.12, -85.0, 85.0, "quick", cone),
    )
    for tiles, spacing_mm, low_deg, high_deg, effort, body in kinds:
        angles = random.uniform(low_deg, high_deg, (tiles, tiles))
        sheet = Grid(angles, np.full((tiles, tiles), spacing_mm), (1.0, 1.0))
        shaped = printable("sheet", hatch.hatch(sheet), "corner", body)
        result = sequence.solve(shaped.problem, objective=goal, effort=effort)
        travel.plan(
            shaped.lines.segments,
            result.order,
            result.flipped,
            clearance_mm=goal.clearance_mm,
            body=body,
            join_mm=1.5 * spacing_mm,
            ends=shaped.ends,
        )


def ship() -> None:
    """Compile everything and leave a note of what it was compiled for."""
    from slicer import machine_code

    with compiling():
        compile_kernels()
    machine_code.shipped_note().write_text(machine_code.toolchain() + "\n")


if __name__ == "__main__":
    ship()
