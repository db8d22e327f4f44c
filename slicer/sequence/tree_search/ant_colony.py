"""Ant colony with local search, as HAS-SOP does it for sequences with precedence.

Gambardella and Dorigo, "An ant colony system hybridized with a new local search for the sequential
ordering problem", INFORMS J. Comput. 12, 2000; Fok et al. 2019, the source paper's [5], use ants for
toolpaths. Ants walk from toolpath to printable toolpath, guided by pheromone and nearness; each sequence is
brought to a local optimum; the best so far is what leaves pheromone. Pheromone lies on the arcs to
neighbours alone, so that memory is linear; an ant with no printable neighbour goes to the nearest printable
toolpath.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.construct import start_greedily
from slicer.sequence.local_search import Tour, reach_local_optimum, refresh, tour_of
from slicer.sequence.problem import Draws, Search, arc_cost, draw

ANTS = {"quick": 50, "default": 500, "high": 5_000}
MOST_STEPS = {"quick": 2_000_000, "default": 8_000_000, "high": 60_000_000}
"""Toolpaths that all ants together may visit."""
FEWEST = 10
EXPLOIT = 0.95
"""How often an ant takes the most attractive arc instead of drawing one."""
FADE = 0.1
"""How much of the pheromone is renewed, by an ant that passes and by the best sequence."""
NEARNESS = 2.0
"""Power of nearness beside pheromone."""
REPORT_EVERY = 20
"""Ants between two reports, at least."""
NONE = -1


def aco(search: Search) -> None:
    """Ant colony from the best sequence so far, or from greedy's."""
    start_greedily(search)
    n = search.problem.n
    work, state = tour_of(search, search.oriented), search.random_state(Draws.ANTS)
    pheromone = np.ones((2 * n, work.near.shape[2]))
    ants = max(FEWEST, min(ANTS[search.effort], MOST_STEPS[search.effort] // n))
    for sent in range(1, ants + 1):
        _walk(work, pheromone, state, int(search.oriented[0]))
        search.nodes_visited += n
        in_time = reach_local_optimum(search, work)
        better = search.offer(work.oriented)
        _reward(work.near, pheromone, search.oriented)
        if better or sent % REPORT_EVERY == 1:
            search.report("ants")
        if not in_time or (sent < ants and search.should_stop()):
            break


@kernel
def _walk(
    tour: Tour,
    pheromone: NDArray[np.float64],
    state: NDArray[np.uint64],
    first: int,
) -> None:
    """One ant's sequence, into the tour; pheromone starts as 1."""
    points, cost_model, links, near, order = tour.points, tour.cost_model, tour.links, tour.near, tour.order
    allowed = tour.allowed
    n = order.shape[1] - 2
    missing = np.empty(n, np.int32)
    ready = np.empty(n, np.int32)
    place = np.full(n, NONE, np.int32)  # where a printable toolpath stands in ``ready``
    count = 0
    for s in range(n):
        missing[s] = links[2 * s + 1] - links[2 * s]
        if missing[s] == 0:
            place[s] = count
            ready[count] = s
            count += 1
    appeal = np.empty(near.shape[2])
    u = first
    for k in range(1, n + 1):
        if k > 1:
            known = NONE
            total, most = 0.0, -1.0
            for t in range(near.shape[2]):
                v = near[u, 0, t]
                appeal[t] = 0.0
                if v < 0 or place[v >> 1] == NONE:
                    continue
                length = arc_cost(points, cost_model, u, v)
                appeal[t] = pheromone[u, t] / (length + 1e-6) ** NEARNESS
                total += appeal[t]
                if appeal[t] > most:
                    known, most = t, appeal[t]
            if known != NONE:
                if draw(state) >= EXPLOIT:
                    rest = draw(state) * total
                    for t in range(near.shape[2]):
                        rest -= appeal[t]
                        if appeal[t] > 0.0:
                            known = t
                            if rest <= 0.0:
                                break
                pheromone[u, known] += FADE * (1.0 - pheromone[u, known])
                u = near[u, 0, known]
            else:
                least = np.inf
                here = u
                for t in range(count):
                    for v in range(2 * ready[t], 2 * ready[t] + 2):
                        if not allowed[v]:
                            continue
                        length = arc_cost(points, cost_model, here, v)
                        if length < least:
                            least, u = length, v
        order[0, k] = u
        s = u >> 1
        count -= 1
        ready[place[s]] = ready[count]
        place[ready[count]] = place[s]
        place[s] = NONE
        for e in range(links[2 * s + 1], links[2 * s + 2]):
            above = links[e]
            missing[above] -= 1
            if missing[above] == 0:
                place[above] = count
                ready[count] = above
                count += 1
    refresh(tour, 1, n + 1)


@kernel
def _reward(near: NDArray[np.int32], pheromone: NDArray[np.float64], best: NDArray[np.int32]) -> None:
    """Lay pheromone along the best sequence; n times the usual amount, as in 1 / J of n arcs."""
    for k in range(1, len(best)):
        for t in range(near.shape[2]):
            if near[best[k - 1], 0, t] == best[k]:
                pheromone[best[k - 1], t] += FADE * (20.0 - pheromone[best[k - 1], t])
