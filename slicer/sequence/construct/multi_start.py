"""Greedy from every possible first toolpath and direction: common practice, the source paper's [4]."""

import numpy as np

from slicer.sequence.construct.hill_climbing import hill_climb
from slicer.sequence.construct.initial import start_greedily
from slicer.sequence.problem import Problem, Search

REPORT_EVERY = 20


def multistart(search: Search) -> None:
    """Hill climbing from each printable toolpath, both ways; the best sequence is kept.

    Where the problem fixes the first toolpath, the second is what is chosen: every oriented toolpath that
    can be printed then.
    """
    problem = search.problem
    start_greedily(search)
    for count, (start, second) in enumerate(_beginnings(problem)):
        if search.should_stop():
            break
        oriented, created = hill_climb(
            problem.segments,
            problem.allowed,
            problem.pred_start,
            problem.succ_start,
            problem.succ,
            start,
            second,
        )
        search.nodes_visited += problem.n
        search.states_created += created
        search.offer(oriented)
        if count % REPORT_EVERY == 0:
            search.report("starts")


def _beginnings(problem: Problem) -> list[tuple[int, int]]:
    """The first oriented toolpath and the second, -1 where that is left to greedy."""
    starts = [int(u) for u in problem.starts]
    if problem.first is None or problem.n == 1:
        return [(u, -1) for u in starts]
    missing = np.diff(problem.pred_start)
    above = problem.succ[problem.succ_start[problem.first] : problem.succ_start[problem.first + 1]]
    missing[above] -= 1
    missing[problem.first] = -1
    printable = np.flatnonzero(missing == 0)
    return [(u, int(2 * s + f)) for u in starts for s in printable for f in range(2) if problem.allowed[s, f]]
