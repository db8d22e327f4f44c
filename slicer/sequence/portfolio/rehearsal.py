"""A rehearsal on six toolpaths, which compiles what the proof of a small sheet comes to last."""

import numpy as np

from slicer.nozzle import POINT
from slicer.sequence.bound import PairBound
from slicer.sequence.layered import doubled, drop_dominated, insert, keep_best, new_pool, rebuild_table
from slicer.sequence.local_search import refine
from slicer.sequence.problem import Objective, Problem, Search, true_cost
from slicer.sequence.states import Section, cover, down_sets


def rehearse() -> None:
    """Run the bound, the pool of the layered search and refinement once; local search is left out."""
    # Two columns of three level toolpaths, built by hand: a job begins with deriving precedence anyway.
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    edges = np.array([[0, 1], [1, 2], [3, 4], [4, 5]], np.int32)
    problem = Problem(
        segments,
        edges,
        edges,
        pred_start=np.array([0, 0, 1, 2, 2, 3, 4], np.int32),
        pred=np.array([0, 1, 3, 4], np.int32),
        succ_start=np.array([0, 1, 2, 2, 3, 4, 4], np.int32),
        succ=np.array([1, 2, 4, 5], np.int32),
        column=np.array([0, 0, 0, 1, 1, 1], np.int32),
        body=POINT,
        allowed=np.ones((6, 2), np.bool_),
        first=0,
        first_flipped=False,
    )
    objective = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)
    # The other process is at the sweep meanwhile, and comes to the bound of its sheet next.
    section = Section.whole(problem, objective)
    sets = down_sets(section, 100)
    bound = PairBound.over(section, sets, cover(sets))
    bound.improve(1e3, 1)
    bound.use_best_multipliers()
    bound.fix_states(1e9)
    order = np.arange(6)
    oriented = (2 * order).astype(np.int32)
    true_cost(problem, objective, oriented)
    # What the proof of a small sheet comes to last; local search is left to the first sheet that needs it.
    pool = new_pool()
    size = insert(pool, 0, np.uint64(1), 0, 0, 0.0, 0.0)
    pool = doubled(pool, size)
    rebuild_table(pool, size)
    keep_best(pool, size, 1)
    drop_dominated(pool, segments, size)
    refine(Search(problem, effort="quick", objective=objective), oriented)
