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
    from slicer.sequence import Problem
    from slicer.sequence.blocks import cover
    from slicer.sequence.candidates import drop_dominated, grown, index, keep_best, new_pool, offer
    from slicer.sequence.cost import Objective
    from slicer.sequence.downsets import down_sets
    from slicer.sequence.method import Options
    from slicer.sequence.pair_bound import PairBound
    from slicer.sequence.refine import refine
    from slicer.sequence.section import Section
    from slicer.sequence.true_cost import true_cost

    # Two columns of three level toolpaths, built by hand: the sweep is what the other process begins with.
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    edges = np.array([[0, 1], [1, 2], [3, 4], [4, 5]], np.int32)
    problem = Problem(
        segments,
        edges,
        pred_start=np.array([0, 0, 1, 2, 2, 3, 4], np.int32),
        pred=np.array([0, 1, 3, 4], np.int32),
        succ_start=np.array([0, 1, 2, 2, 3, 4, 4], np.int32),
        succ=np.array([1, 2, 4, 5], np.int32),
        column=np.array([0, 0, 0, 1, 1, 1], np.int32),
        first=0,
        first_flipped=False,
    )
    goal = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)
    # The other process is at the sweep meanwhile, and comes to the bound of its sheet next.
    section = Section.whole(problem, goal)
    sets = down_sets(section, 100)
    bound = PairBound.over(section, sets, cover(sets))
    bound.improve(1e3, 1)
    bound.settle()
    bound.strike(1e9)
    order = np.arange(6)
    travel.plan(segments, order, np.zeros(6, np.bool_), clearance_mm=0.2)
    oriented = (2 * order).astype(np.int32)
    true_cost(problem, goal, oriented)
    # What the proof of a small sheet comes to last; local search is left to the first sheet that needs it.
    pool = new_pool()
    size = offer(pool, 0, np.uint64(1), 0, 0, 0.0, 0.0)
    pool = grown(pool, size)
    index(pool, size)
    keep_best(pool, size, 1)
    drop_dominated(pool, segments, size)
    refine(problem, Options(effort="quick", objective=goal), oriented)
