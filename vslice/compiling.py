"""Machine code before it is needed: what the installation compiles, and what a first run without it does."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

HELPED_FROM = 3
"""Kernels that a process compiles by itself; a change that touches no more needs no second process."""


@contextmanager
def compiling(tell: Callable[[str], None] | None = None, everything: bool = False) -> Iterator[bool]:
    """Say it once where a job compiles kernels, and let a second process compile what it needs last.

    The job compiles what it needs first, and alone where it has one core. Machine code is kept on disk, so
    either process finds what the other has compiled, and waits for what the other is compiling. Yields
    whether not even a job's first kernel is there, so that all have to be compiled.

    Args:
        tell: is told in one line; None for silence.
        everything: see ``compile_the_rest``.
    """
    from slicer.kernels import is_kept, tell_of_compiling
    from slicer.processes import usable_cores
    from slicer.sweep import sweep

    compiled, cores = 0, usable_cores()
    helper = multiprocessing.get_context("spawn").Process(
        target=compile_the_rest, args=(everything,), daemon=True
    )

    def told() -> None:
        nonlocal compiled
        compiled += 1
        if compiled == 1 and tell is not None:
            tell("Compiling for this machine; later runs find it done.")
        if compiled == HELPED_FROM and cores > 1:
            helper.start()

    try:
        with tell_of_compiling(told):
            yield not is_kept(sweep)
    finally:
        if helper.pid is not None:
            helper.terminate()
            helper.join()


def compile_the_rest(everything: bool = False) -> None:
    """Compile what a job comes to, from its end: the routing of travels, refinement, and so on to the bound.

    To be called in a process of its own, which the caller ends. ``everything`` goes on with the sheets of
    ``compile_kernels``, from the last to the first.
    """
    import numpy as np

    from slicer import travel
    from slicer.nozzle import NozzleBody
    from slicer.processes import end_with_parent
    from slicer.sequence.portfolio import rehearse

    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the job hears of Ctrl-C, and ends this
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    travel.plan(
        segments,
        np.arange(6),
        np.zeros(6, np.bool_),
        clearance_mm=0.2,
        body=NozzleBody.of(*NEEDLE),
        join_mm=1.5 if everything else 0.0,
    )
    rehearse()
    if everything:
        compile_kernels(backwards=True)


NEEDLE, CONE = (0.2, 0.0, 5.0, 4.0, 0.1), (0.3, 30.0, 5.0, 6.0, 0.06)
"""Two nozzles, as ``NozzleBody.of`` takes them; toolpaths stand in each other's way under the second."""


def compile_kernels(backwards: bool = False) -> None:
    """Order small sheets of every kind by the default way, and so compile what it runs."""
    import numpy as np

    from slicer import hatch, sequence, travel
    from slicer.grid import Grid
    from slicer.nozzle import POINT, NozzleBody
    from slicer.sequence.portfolio import rehearse, rehearse_large
    from slicer.sequence.problem import Objective
    from vslice.printable import printable

    random = np.random.default_rng(1)
    goal = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)
    # Proved; searched only; and so steep that its down-sets are too many, or that it has to be cut.
    kinds = [
        (random.uniform(low_deg, high_deg, (tiles, tiles)), spacing_mm, effort, body)
        for tiles, spacing_mm, low_deg, high_deg, effort, body in (
            (2, 0.2, -45.0, 0.0, "default", POINT),
            (4, 0.12, -45.0, 0.0, "quick", POINT),
            (6, 0.12, -85.0, 85.0, "quick", POINT),
            (3, 0.2, -45.0, 0.0, "default", NozzleBody.of(*NEEDLE)),
            (3, 0.12, -85.0, 85.0, "quick", NozzleBody.of(*CONE)),
        )
    ]
    for angles, spacing_mm, effort, body in reversed(kinds) if backwards else kinds:
        sheet = Grid(angles, np.full(angles.shape, spacing_mm), (1.0, 1.0))
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
    if not backwards:  # what sheets come to that are neither so small nor ordered so quickly
        rehearse()
        rehearse_large()


def compile_references() -> None:
    """Compile what ``compare`` holds prints against: greedy with a tree's bound, and no precedence at all."""
    import numpy as np

    from slicer.grid import Grid
    from slicer.hatch import hatch
    from slicer.sequence import solve
    from slicer.sequence.problem import Search
    from slicer.sequence.rural_postman import without_precedence
    from vslice.printable import problem_of

    sheet = Grid(np.full((1, 2), 30.0), np.full((1, 2), 0.3), (1.0, 1.0))
    problem = problem_of(hatch(sheet).segments, "corner")
    found = solve(problem, method="greedy")
    oriented = (2 * found.order + found.flipped).astype(np.int32)
    without_precedence(Search(problem, effort="quick", initial=oriented))


def ship() -> None:
    """Compile everything and leave a note of what it was compiled for."""
    from slicer.kernels import machine_code

    with compiling(everything=True):
        compile_kernels()
        compile_references()
    machine_code.shipped_note().write_text(machine_code.toolchain() + "\n")


if __name__ == "__main__":
    ship()
