"""The first run after installation: numba compiles for this machine, on two cores where there are two."""

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def compiling() -> Iterator[bool]:
    """Let a second process compile what a job needs last, while the job compiles what it needs first.

    Numba keeps machine code on disk, so either process finds what the other has compiled. Yields whether
    anything has to be compiled at all.
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
    """Run the bound, refinement and the routing of travels on six toolpaths, and so compile them."""
    import numpy as np

    from slicer import travel
    from slicer.sequence.portfolio import rehearse

    rehearse()
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    travel.plan(segments, np.arange(6), np.zeros(6, np.bool_), clearance_mm=0.2)
