"""Monte Carlo tree search over the precedence graph.

After Yoo, Suh and Choi, "Monte Carlo tree search for the toolpath sequencing of 3D printing", ICRA 2020, the
source paper's [9]: nodes are partial sequences, a rollout completes one by randomised greedy, and upper
confidence bounds decide where to go next. The sheet is long: after each batch of rollouts the next stretch of
the best sequence so far becomes the root.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, kernel
from slicer.sequence.directions import directed
from slicer.sequence.incumbent import Incumbent
from slicer.sequence.kicks import draw
from slicer.sequence.method import Found, Options
from slicer.sequence.problem import Problem

ROLLOUTS_PER_TOOLPATH = {"quick": 2, "default": 10, "high": 60}
MOST_STEPS = {"quick": 10_000_000, "default": 60_000_000, "high": 400_000_000}
"""Toolpaths that all rollouts together may sequence."""
BATCH = 100
BRANCHES = 4
"""How many of the nearest printable endpoints become children of a node."""
EXPLORE = 0.3
"""Weight of the confidence bound, in units of the spread of costs seen."""
STRAY = 0.05
"""How often a rollout takes the second nearest endpoint."""
NONE = -1


def mcts(problem: Problem, options: Options) -> Found:
    """Monte Carlo tree search; never worse than ``options.initial`` or greedy."""
    n = problem.n
    if n == 0:
        return Found(np.empty(0, np.int32))
    incumbent = Incumbent(problem, options)
    state = np.array([np.random.SeedSequence([options.seed, 2]).generate_state(1, np.uint64)[0]])
    rollouts = max(BATCH, min(ROLLOUTS_PER_TOOLPATH[options.effort] * n, MOST_STEPS[options.effort] // n))
    batches = -(-rollouts // BATCH)
    points = problem.segments.reshape(-1, 2)
    first = int(incumbent.oriented[0])
    best = incumbent.oriented.copy()
    nodes = states = 0
    stopped = False
    try:
        for batch in range(batches):
            fixed = max(1, n * batch // batches)
            best, visited, created = _search(
                points,
                options.objective.parameters(),
                problem.pred_start,
                problem.succ_start,
                problem.succ,
                best,
                fixed,
                state,
            )
            nodes, states = nodes + visited, states + created
            incumbent.offer(best)
            incumbent.report("tree search", bounded=False)
            if options.out_of_time():
                stopped = True
                break
    except KeyboardInterrupt:
        stopped = True
    if problem.first_flipped is not None or int(incumbent.oriented[0]) == first:
        incumbent.offer(directed(problem, incumbent.oriented >> 1, options.objective))
    return Found(incumbent.oriented, nodes, states, stopped=stopped)


@kernel
def _search(
    points: NDArray[np.float64],
    parameters: NDArray[np.float64],
    pred_start: NDArray[np.int32],
    succ_start: NDArray[np.int32],
    succ: NDArray[np.int32],
    best: NDArray[np.int32],
    fixed: int,
    state: NDArray[np.uint64],
) -> tuple[NDArray[np.int32], int, int]:
    """A batch of rollouts below the first ``fixed`` toolpaths of ``best``: (best, nodes, states)."""
    n = len(best)
    capacity = BATCH * BRANCHES + 1
    child = np.full((capacity, BRANCHES), NONE, np.int32)
    endpoint = np.full(capacity, NONE, np.int32)
    visits = np.zeros(capacity)
    total = np.zeros(capacity)
    made = 1
    low_cost, high_cost = np.inf, -np.inf
    root_missing = pred_start[1:] - pred_start[:-1]
    for s in best[:fixed] >> 1:
        for e in range(succ_start[s], succ_start[s + 1]):
            root_missing[succ[e]] -= 1
        root_missing[s] = NONE
    root_ready = np.flatnonzero(root_missing == 0).astype(np.int32)
    root_cost = 0.0
    for k in range(1, fixed):
        root_cost += _hop(points, best[k - 1], best[k])
    best_cost = root_cost
    for k in range(fixed, n):
        best_cost += _hop(points, best[k - 1], best[k])
    best = best.copy()
    ready = np.empty(n, np.int32)
    sequence = best.copy()
    missing = np.empty(n, np.int32)
    path = np.empty(n + 1, np.int32)
    nodes = states = 0
    near = np.empty(BRANCHES, np.int32)
    for _ in range(BATCH):
        missing[:] = root_missing
        count = len(root_ready)
        ready[:count] = root_ready
        sequence[:fixed] = best[:fixed]
        cost = root_cost
        node, depth = 0, 0
        path[0] = 0
        for k in range(fixed, n):
            u = sequence[k - 1]
            nodes += 1
            states += 2 * count
            if node != NONE and visits[node] > 0 and child[node, 0] == NONE:
                found = _nearest(points, ready, count, u, near)
                for b in range(found):
                    child[node, b] = made
                    endpoint[made] = near[b]
                    made += 1
            if node != NONE and child[node, 0] != NONE:
                chosen, score = NONE, -np.inf
                for b in range(BRANCHES):
                    c = child[node, b]
                    if c == NONE:
                        break
                    if visits[c] == 0:
                        chosen = c
                        break
                    worth = (high_cost - total[c] / visits[c]) / max(high_cost - low_cost, 1e-12)
                    worth += EXPLORE * np.sqrt(np.log(visits[node]) / visits[c])
                    if worth > score:
                        chosen, score = c, worth
                node = chosen
                depth += 1
                path[depth] = node
                v = endpoint[node]
                leaf = visits[node] == 0
            else:
                leaf = True
                found = _nearest(points, ready, count, u, near)
                v = near[1] if found > 1 and draw(state) < STRAY else near[0]
                node = NONE
            if leaf:
                node = NONE
            cost += _hop(points, u, v)
            sequence[k] = v
            s = v >> 1
            for t in range(count):
                if ready[t] == s:
                    count -= 1
                    ready[t] = ready[count]
                    break
            for e in range(succ_start[s], succ_start[s + 1]):
                missing[succ[e]] -= 1
                if missing[succ[e]] == 0:
                    ready[count] = succ[e]
                    count += 1
        low_cost, high_cost = min(low_cost, cost), max(high_cost, cost)
        for d in range(depth + 1):
            visits[path[d]] += 1
            total[path[d]] += cost
        if cost < best_cost:
            best_cost = cost
            best[:] = sequence
    return best, nodes, states


@bare_kernel
def _hop(points: NDArray[np.float64], u: int, v: int) -> float:
    return float(np.hypot(points[v, 0] - points[u ^ 1, 0], points[v, 1] - points[u ^ 1, 1]))


@bare_kernel
def _nearest(
    points: NDArray[np.float64], ready: NDArray[np.int32], count: int, u: int, near: NDArray[np.int32]
) -> int:
    """Fill ``near`` with the nearest entries of printable toolpaths, nearest first; how many there are."""
    found = 0
    for t in range(count):
        for v in range(2 * ready[t], 2 * ready[t] + 2):
            d = _hop(points, u, v)
            if found == len(near) and d >= _hop(points, u, near[found - 1]):
                continue
            found = min(found + 1, len(near))
            at = found - 1
            while at > 0 and _hop(points, u, near[at - 1]) > d:
                near[at] = near[at - 1]
                at -= 1
            near[at] = v
    return found
