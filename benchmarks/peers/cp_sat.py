"""OR-Tools CP-SAT: a circuit through one of the two nodes of each toolpath, and positions for precedence.

Arcs that precedence rules out are left out of the circuit. Each toolpath has a position, bounded by how
many must come before and after it; an arc that is used makes positions consecutive. The order to start
from is given as a hint. One worker, with the portfolio of searches interleaved on it.

Beyond ``MOST_ARCS`` simplifying the model takes longer than a benchmark can wait, and it ends without even
the order of the hint: each node then keeps the arcs to its nearest
successors and those of the order to start from. Nothing is proved about the problem itself in that case.
"""

import numpy as np
import ortools
from model import Model, read, write
from numpy.typing import NDArray
from ortools.sat.python import cp_model

MOST_ARCS = 50_000
NEAREST = 12


def main() -> None:
    """Solve one problem."""
    model = read()
    n, depot = model.n, 2 * model.n
    task = cp_model.CpModel()
    arcs, complete = candidates(model)
    earliest = model.ancestors.sum(axis=0)
    latest = n - 1 - model.ancestors.sum(axis=1)
    position = [task.new_int_var(int(earliest[s]), int(latest[s]), f"position {s}") for s in range(n)]
    for a, b in model.before:
        task.add(position[a] < position[b])

    used = dict(zip(model.initial, model.initial[1:], strict=False))
    circuit, costs, literals = [], [], []
    for u, v in arcs.tolist():
        literal = task.new_bool_var("")
        circuit.append((u, v, literal))
        literals.append(literal)
        costs.append(int(model.cost[u, v]))
        task.add(position[v >> 1] == position[u >> 1] + 1).only_enforce_if(literal)
        if used:
            task.add_hint(literal, used.get(u) == v)
    for nodes, place, end in ((model.starts, 0, 0), (model.ends, n - 1, -1)):
        for v in nodes:
            literal = task.new_bool_var("")
            circuit.append((depot, v, literal) if place == 0 else (v, depot, literal))
            task.add(position[v >> 1] == place).only_enforce_if(literal)
            if used:
                task.add_hint(literal, model.initial[end] == v)
    visited = set(model.initial)
    for s in range(n):
        flipped = task.new_bool_var("")
        # A loop at a node leaves it out: one direction or the other.
        circuit += [(2 * s, 2 * s, flipped), (2 * s + 1, 2 * s + 1, ~flipped)]
        if used:
            task.add_hint(flipped, 2 * s + 1 in visited)
    for k, v in enumerate(model.initial):
        task.add_hint(position[v >> 1], k)
    task.add_circuit(circuit)
    task.minimize(cp_model.LinearExpr.weighted_sum(literals, costs))

    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = model.time_limit_s
    solver.parameters.num_workers = 1
    solver.parameters.interleave_search = True
    solver.parameters.linearization_level = 2
    # Left on, probing of this many literals takes the whole time before the search even begins.
    solver.parameters.cp_model_probing_level = 0
    status = solver.solve(task)
    proved = status == cp_model.OPTIMAL and complete
    found = status in (cp_model.OPTIMAL, cp_model.FEASIBLE)
    nodes = tour(circuit, solver, depot) if found else None
    bound = solver.best_objective_bound if complete and status != cp_model.UNKNOWN else None
    write(model, nodes, bound=bound, proved=proved, version=ortools.__version__)


def candidates(model: Model) -> tuple[NDArray[np.int64], bool]:
    """int64 (k, 2), the arcs of the circuit, and whether they are all that precedence allows."""
    follows = np.repeat(np.repeat(model.follows, 2, axis=0), 2, axis=1)
    if follows.sum() <= MOST_ARCS:
        return np.argwhere(follows), True
    length = np.where(follows, model.cost, np.iinfo(np.int64).max)
    nearest = np.argpartition(length, NEAREST, axis=1)[:, :NEAREST]
    kept = np.zeros_like(follows)
    np.put_along_axis(kept, nearest, True, axis=1)
    kept[model.initial[:-1], model.initial[1:]] = True
    return np.argwhere(kept & follows), False


def tour(circuit: list[tuple[int, int, cp_model.IntVar]], solver: cp_model.CpSolver, depot: int) -> list[int]:
    """The nodes in the order of the circuit that the solver chose."""
    after = {u: v for u, v, literal in circuit if u != v and solver.boolean_value(literal)}
    nodes = []
    v = after[depot]
    while v != depot:
        nodes.append(v)
        v = after[v]
    return nodes


if __name__ == "__main__":
    main()
