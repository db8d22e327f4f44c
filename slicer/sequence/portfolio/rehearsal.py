"""A rehearsal on six toolpaths: it compiles what ordering a small sheet comes to, and then the rest."""

import numpy as np

from slicer.nozzle import POINT
from slicer.sequence.bound import PairBound, step_lengths
from slicer.sequence.layered import streamed_beam
from slicer.sequence.local_search import anneal, refine
from slicer.sequence.problem import Objective, Problem, Search
from slicer.sequence.states import Section, cover, down_sets
from slicer.sequence.tree_search import improve_by_trees


def rehearse() -> None:
    """Run the bound once, which every job needs, then what only those need that are not proved at once.

    That is refinement, local search and trees.

    A job comes to them in turned order: who rehearses beside it meets it in the middle, and so little is
    waited for. What comes last is then hardly begun where a job does without it.
    """
    problem = _six_toolpaths()
    objective = Objective("time", 0.2, (100.0, 100.0, 10.0), (500.0, 500.0, 100.0), 0.1, 1.0)
    order = np.arange(6)
    oriented = (2 * order).astype(np.int32)
    section = Section.whole(problem, objective)
    sets = down_sets(section, 100)
    bound = PairBound.over(section, sets, cover(sets))
    bound.improve(1e3, step_lengths(1))
    bound.use_best_multipliers()
    bound.fix_states(1e9)
    refine(Search(problem, effort="quick", objective=objective), oriented)
    direct = Search(problem, effort="quick", objective=Objective("time"))
    direct.offer(oriented)
    anneal(direct, perturbations=1)
    improve_by_trees(direct, oriented, rollouts=1, stream=0)


def rehearse_large() -> None:
    """Run the bound of large sheets and its beam once, which small sheets do without."""
    search = Search(_six_toolpaths())
    search.offer((2 * np.arange(6)).astype(np.int32))
    streamed_beam(search)


def _six_toolpaths() -> Problem:
    # Two columns of three level toolpaths, built by hand: a job begins with deriving precedence anyway.
    segments = np.array([[[col, row], [col + 1, row]] for col in (0.0, 1.0) for row in (0.0, 1.0, 2.0)])
    edges = np.array([[0, 1], [1, 2], [3, 4], [4, 5]], np.int32)
    return Problem(
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
