"""Local search from any start: sweeps of kicks and descent, cooling down.

A sweep kicks along the whole sequence once; what a kick has made worse is kept less and less often from sweep
to sweep. Long sequences get fewer kicks for each toolpath.
"""

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.exchange import Tour, tour
from slicer.sequence.incumbent import Incumbent
from slicer.sequence.kicks import iterate
from slicer.sequence.levels import level_start
from slicer.sequence.method import Found, Options
from slicer.sequence.neighbours import Neighbours, neighbours
from slicer.sequence.problem import Problem

KICKS_PER_TOOLPATH = {"quick": 60, "default": 250, "high": 3_000}
MOST_KICKS = {"quick": 100_000, "default": 650_000, "high": 2_500_000}
"""Beyond these a toolpath gets less than that, but never less than the next."""
FEWEST = {"quick": 10, "default": 30, "high": 150}
SWEEPS = 20
CHUNK = 50_000
"""About so many kicks pass between two looks at the clock."""
HEAT = 1.0
"""Temperature of the first sweep, in costs of a travel of the usual length between toolpaths."""


def local(problem: Problem, options: Options) -> Found:
    """Improve ``options.initial``, or the start along levels, by kicks and descent."""
    if problem.n == 0:
        return Found(np.empty(0, np.int32))
    near = neighbours(problem, options.objective)
    if options.initial is None:
        start = level_start(problem, options.objective, near, options.out_of_time)
        options = options.starting_from(start)
    incumbent = Incumbent(problem, options)
    stopped = False
    try:
        stopped = not improve(problem, options, near, incumbent, kicks=budget(problem.n, options.effort))
    except KeyboardInterrupt:
        stopped = True
    return Found(incumbent.oriented, stopped=stopped)


def budget(n: int, effort: str) -> int:
    """How many kicks a sequence of n toolpaths is given."""
    return max(FEWEST[effort] * n, min(KICKS_PER_TOOLPATH[effort] * n, MOST_KICKS[effort]))


def improve(
    problem: Problem,
    options: Options,
    near: Neighbours,
    incumbent: Incumbent,
    *,
    kicks: int,
    heat: float = HEAT,
    salt: int = 0,
) -> bool:
    """Spend kicks on the incumbent's sequence and offer it what comes out; False where time ran out.

    Args:
        problem: what is ordered.
        options: seed, objective, deadline and progress.
        near: the candidates of the descent.
        incumbent: where the search starts, and what is offered the results.
        kicks: the budget.
        heat: temperature of the first sweep, see ``HEAT``.
        salt: tells apart the random numbers of several calls with one seed.
    """
    start = incumbent.oriented
    for oriented in cooled(problem, options, near, start, kicks=kicks, heat=heat, salt=salt):
        incumbent.offer(oriented)
        if options.out_of_time():
            return False
        incumbent.report("local search")
    return True


def cooled(
    problem: Problem,
    options: Options,
    near: Neighbours,
    oriented: NDArray[np.int32],
    *,
    kicks: int,
    heat: float,
    salt: int,
) -> Iterator[NDArray[np.int32]]:
    """The sequences (n,) after each sweep of a run that cools down from ``heat`` to nothing.

    Ends early where time runs out. The arguments are those of ``improve``, but for ``oriented``, where the
    run starts.
    """
    work = tour(problem, options.objective, near, oriented)
    state = np.array([np.random.SeedSequence([options.seed, salt]).generate_state(1, np.uint64)[0]])
    scale = heat * _usual(work)
    high = problem.n + 1
    chunks = max(1, kicks // SWEEPS // CHUNK)
    bounds = np.linspace(work.fixed, high, chunks + 1).astype(int)
    for sweep in range(SWEEPS):
        temperature = scale * (1 - (sweep + 1) / SWEEPS)
        for low, end in itertools.pairwise(bounds):
            iterate(*work, state, kicks // SWEEPS // chunks, int(low), int(end), temperature)
            if options.out_of_time():
                yield work.oriented
                return
        yield work.oriented


def _usual(work: Tour) -> float:
    """The median cost of a travel."""
    costs: NDArray[np.float64] = work.cost[0, 2:-1]
    return float(np.median(costs)) if len(costs) else 0.0
