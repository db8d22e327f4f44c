"""Local search from any start: sweeps of perturbations and descent, cooling down.

A sweep perturbs the whole sequence once from its start to its end; what has become worse is kept less and
less often from sweep to sweep. Long sequences get fewer perturbations for each toolpath.
"""

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.construct import start_along_levels
from slicer.sequence.local_search.block_exchange import Tour
from slicer.sequence.local_search.perturbation import iterated_local_search
from slicer.sequence.local_search.start import tour_of
from slicer.sequence.problem import Draws, Search

PERTURBATIONS_PER_TOOLPATH = {"quick": 60, "default": 250, "high": 3_000}
MOST_PERTURBATIONS = {"quick": 100_000, "default": 650_000, "high": 2_500_000}
"""Beyond these a toolpath gets less than that, but never less than the next."""
FEWEST = {"quick": 10, "default": 30, "high": 150}
SWEEPS = 20
CHUNK = 50_000
"""About so many perturbations pass between two looks at the clock."""
FIRST_TEMPERATURE = 1.0
"""Temperature of the first sweep, in costs of a travel of the usual length between toolpaths."""


def local(search: Search) -> None:
    """Improve the best sequence so far, or the start along levels, by perturbations and descent."""
    start_along_levels(search)
    anneal(search, perturbations=perturbation_budget(search.problem.n, search.effort))


def perturbation_budget(n: int, effort: str) -> int:
    """How many perturbations a sequence of n toolpaths is given."""
    return max(FEWEST[effort] * n, min(PERTURBATIONS_PER_TOOLPATH[effort] * n, MOST_PERTURBATIONS[effort]))


def anneal(
    search: Search, *, perturbations: int, first_temperature: float = FIRST_TEMPERATURE, stream: int = 0
) -> bool:
    """Spend perturbations on the best sequence and offer what comes out; False where time ran out.

    Args:
        search: where it starts, and what is offered the results.
        perturbations: how many.
        first_temperature: temperature of the first sweep, see ``FIRST_TEMPERATURE``.
        stream: tells apart the random numbers of several calls with one seed.
    """
    for oriented in annealed(
        search,
        search.oriented,
        perturbations=perturbations,
        first_temperature=first_temperature,
        stream=stream,
    ):
        search.offer(oriented)
        if search.should_stop():
            return False
        search.report("local search")
    return True


def annealed(
    search: Search,
    oriented: NDArray[np.int32],
    *,
    perturbations: int,
    first_temperature: float,
    stream: int,
) -> Iterator[NDArray[np.int32]]:
    """The sequences (n,) after each sweep of a run that cools down from ``first_temperature`` to nothing.

    Ends early where time runs out. The arguments are those of ``anneal``, but for ``oriented``, where the
    run starts.
    """
    work = tour_of(search, oriented)
    state = search.random_state(Draws.ANNEALING, stream)
    scale = first_temperature * _usual(work)
    high = search.problem.n + 1
    chunks = max(1, perturbations // SWEEPS // CHUNK)
    bounds = np.linspace(work.fixed, high, chunks + 1).astype(int)
    for sweep in range(SWEEPS):
        temperature = scale * (1 - (sweep + 1) / SWEEPS)
        for low, end in itertools.pairwise(bounds):
            iterated_local_search(
                work, state, perturbations // SWEEPS // chunks, int(low), int(end), temperature
            )
            if search.should_stop():
                yield work.oriented
                return
        yield work.oriented


def _usual(work: Tour) -> float:
    """The median cost of a travel."""
    costs: NDArray[np.float64] = work.cost[0, 2:-1]
    return float(np.median(costs)) if len(costs) else 0.0
