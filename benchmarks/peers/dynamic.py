"""DIDPPy: domain-independent dynamic programming, solved by complete anytime beam search (CABS).

A state is the set of toolpaths not printed yet and the node visited last, which is the model that the
authors of DIDP give for the travelling salesman with precedence. Bounds on the rest: each toolpath still
to come is entered by its shortest possible arc; and up to ``TREE_UP_TO`` toolpaths, they are spanned by a
tree that the shortest arc from here leads to. The tree is by far the better bound on what was measured,
but it costs the square of the toolpaths in every state.
"""

import didppy as dp
import numpy as np
from model import Model, read, write
from numpy.typing import NDArray

TREE_UP_TO = 500


def main() -> None:
    """Solve one problem."""
    model = read()
    n, nowhere = model.n, 2 * model.n
    task = dp.Model(maximize=False, float_cost=False)
    toolpath = task.add_object_type(number=n)
    node = task.add_object_type(number=2 * n + 1)
    left = task.add_set_var(object_type=toolpath, target=list(range(n)))
    at = task.add_element_var(object_type=node, target=nowhere)

    arcs = np.zeros((2 * n + 1, 2 * n + 1), np.int64)
    arcs[:-1, :-1] = model.cost
    length = task.add_int_table(arcs.tolist())
    enter, leave, pair = shortest(model)
    to_enter = task.add_int_table(enter.tolist())

    under: list[list[int]] = [[] for _ in range(n)]
    for a, b in model.before:
        under[b].append(a)
    task.add_base_case([left.is_empty()])
    for v in range(2 * n):
        s = v >> 1
        allowed = [left.contains(s)]
        if under[s]:
            below = task.create_set_const(object_type=toolpath, value=under[s])
            allowed.append(left.isdisjoint(below))
        task.add_transition(
            dp.Transition(
                name=str(v),
                cost=length[at, v] + dp.IntExpr.state_cost(),
                preconditions=allowed,
                effects=[(left, left.remove(s)), (at, v)],
            )
        )
    task.add_dual_bound(to_enter[left])
    if n <= TREE_UP_TO:
        to_leave = task.add_int_table([*leave.tolist(), 0])
        tree = dp.minimum_spanning_tree(left, task.add_int_table(pair.tolist()))
        task.add_dual_bound(left.is_empty().if_then_else(0, to_leave[at] + tree))

    solution = dp.CABS(task, time_limit=model.time_limit_s, quiet=True).search()
    nodes = [int(step.name) for step in solution.transitions] or None
    bound = solution.cost if solution.is_optimal else solution.best_bound
    write(model, nodes, bound=bound, proved=solution.is_optimal, version=dp.__version__)


def shortest(model: Model) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The shortest arcs that precedence allows.

    Returns:
        int64 (n,), into each toolpath, 0 where it may be the first; int64 (2n,), out of each node, 0 where
        it may be the last; int64 (n, n), between two toolpaths in either order.
    """
    n, far = model.n, 10**9
    follows = np.repeat(np.repeat(model.follows, 2, axis=0), 2, axis=1)
    arcs = np.where(follows, model.cost, far)
    enter = arcs.min(axis=0, initial=far).reshape(n, 2).min(axis=1)
    enter[[v >> 1 for v in model.starts]] = 0
    leave = arcs.min(axis=1, initial=far)
    leave[model.ends] = 0
    pair = arcs.reshape(n, 2, n, 2).min(axis=(1, 3), initial=far)
    return enter, leave, np.minimum(pair, pair.T)


if __name__ == "__main__":
    main()
