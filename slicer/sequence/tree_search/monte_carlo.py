"""Monte Carlo tree search over the precedence graph, whose rollouts are repaired by descent.

After Yoo, Suh and Choi, "Monte Carlo tree search for the toolpath sequencing of 3D printing", ICRA 2020, the
source paper's [9]: nodes are partial sequences, rollouts complete them, confidence bounds decide where to go
next (UCT: Kocsis and Szepesvári, ECML 2006). What is different here:

- A sheet is too long for one tree. The root moves along the best sequence so far, and a tree orders the
  stretch behind it; after a budget of rollouts the first toolpaths of what has become the best sequence are
  committed to, and the next tree begins behind them; only descent may still touch them. Several passes go
  over the sheet.
- A node gets its children one by one, the nearest printable toolpath first, with the root of its visits
  (progressive widening: Coulom, "Computing Elo ratings of move patterns in the game of Go", 2007).
- A rollout is randomised greedy by the objective's cost of a travel and, so that nothing is left behind, by
  how late a toolpath comes in the best sequence. It starts from greedy along levels.
- Each rollout is brought to a local optimum by block exchange, as HAS-SOP does it for its ants (see ``aco``),
  and that is what the tree learns. The worth of a node is the middle between the mean of its costs and the
  least, for there is no opponent (Schadd et al., "Single-player Monte-Carlo tree search", 2008).

What the tree contributes beside rollouts and descent is measured in ``docs/results.md``.
"""

from slicer.sequence.construct import start_along_levels
from slicer.sequence.local_search import Tour, reach_local_optimum, tour_of
from slicer.sequence.problem import Draws, Search, directed
from slicer.sequence.tree_search.passes import search_pass, tree_count

ROLLOUTS_PER_TOOLPATH = {"quick": 10, "default": 35, "high": 300}
MOST_ROLLOUTS = {"quick": 50_000, "default": 300_000, "high": 1_500_000}
"""Beyond these a toolpath gets less than that."""
FEWEST = {"quick": 2_000, "default": 10_000, "high": 50_000}
ROLLOUTS = 100
"""The most rollouts of a tree."""


def mcts(search: Search) -> None:
    """Monte Carlo tree search from the best sequence so far, or from greedy's along levels.

    ``nodes_visited`` counts the toolpaths that rollouts have put in order, ``states_created`` two for each
    that could have been next.
    """
    start_along_levels(search)
    work = tour_of(search, search.oriented)
    try:
        _passes(search, work)
    finally:  # Ctrl-C comes between two kernels
        search.offer(work.oriented)
    search.offer(directed(search.problem, search.oriented >> 1, search.objective))


def _passes(search: Search, work: Tour) -> None:
    """Let the root move along the sequence again and again."""
    n = search.problem.n
    if not reach_local_optimum(search, work):
        return
    search.offer(work.oriented)
    search.report("local optimum")
    effort = search.effort
    total = max(FEWEST[effort], min(ROLLOUTS_PER_TOOLPATH[effort] * n, MOST_ROLLOUTS[effort]))
    trees = tree_count(work)
    passes = max(1, round(total / (ROLLOUTS * trees)))
    rollouts = max(1, min(ROLLOUTS, total // (passes * trees)))
    state = search.random_state(Draws.TREES)
    for _ in range(passes):
        if not search_pass(search, work, state, rollouts):
            return
