"""What the peers share: the problem read from JSON, as a sequential ordering problem, and the answer.

Each script here runs by itself, with an interpreter that has the peer and numpy installed, and imports
nothing of this project:

    python benchmarks/peers/routing.py < problem.json

The problem is read from the file named on the command line, or else from stdin:

    {"segments": (n, 2, 2), "edges": [[a, b], ...], "first": number or null, "time_limit_s": number,
     "initial": [[toolpath, flipped], ...], "cost": (2n, 2n)}

``edges`` is the covering relation: a is printed before b. ``initial`` is the order to start from, and may
be missing. ``cost`` is that of the travel from the end of one oriented toolpath to the entry of another, in
whole numbers of 1e-6 of its unit; where it is missing, travels cost their straight length. The answer goes
to stdout:

    {"order": [[toolpath, flipped], ...] or null, "bound": number or null, "proved": bool,
     "seconds": number, "version": text}

A toolpath s printed in direction f is node ``2 * s + f``; exactly one of its two nodes is visited. Costs
are whole numbers of 1e-6 units, as most of these solvers require. ``seconds`` are those of the processor,
with the making of the model; the time limit is for the solver alone.
"""

import json
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SCALE = 1_000_000


@dataclass(frozen=True)
class Model:
    """A sequential ordering problem with two nodes for each toolpath.

    Attributes:
        n: the number of toolpaths.
        cost: int64 (2n, 2n), from where a node is left to where another is entered, times ``SCALE``.
        before: list of (a, b) of toolpaths; where the first is given, it comes before all others.
        first: the toolpath to begin with, or None.
        ancestors: bool (n, n); [a, b] where a must be printed before b, at any distance.
        follows: bool (n, n); [a, b] where b can be printed directly after a.
        initial: nodes of the order to start from, or empty.
        time_limit_s: for the solver.
    """

    n: int
    cost: NDArray[np.int64]
    before: list[tuple[int, int]]
    first: int | None
    ancestors: NDArray[np.bool_]
    follows: NDArray[np.bool_]
    initial: list[int]
    time_limit_s: float

    @property
    def starts(self) -> list[int]:
        """Nodes that an order may begin with."""
        return [2 * s + f for s in range(self.n) if not self.ancestors[:, s].any() for f in range(2)]

    @property
    def ends(self) -> list[int]:
        """Nodes that an order may end with."""
        return [2 * s + f for s in range(self.n) if not self.ancestors[s].any() for f in range(2)]


def read() -> Model:
    """The problem from the file that the command line names, or from stdin."""
    text = Path(sys.argv[1]).read_text(encoding="utf-8") if len(sys.argv) > 1 else sys.stdin.read()
    data = json.loads(text)
    segments = np.array(data["segments"], float).reshape(-1, 2, 2)
    n, first = len(segments), data["first"]
    before = [(int(a), int(b)) for a, b in data["edges"]]
    if first is not None:
        above = {b for _, b in before}
        before += [(first, s) for s in range(n) if s != first and s not in above]
    if "cost" in data:
        cost = np.array(data["cost"], np.int64).reshape(2 * n, 2 * n)
    else:
        enter = segments.reshape(2 * n, 2)
        leave = segments[:, ::-1].reshape(2 * n, 2)
        distance = np.hypot(*(enter[None, :] - leave[:, None]).transpose(2, 0, 1))
        cost = np.rint(distance * SCALE).astype(np.int64)
    ancestors = _closure(n, before)
    # b cannot follow a directly where it comes before a, or where others must come in between.
    between = (ancestors.astype(np.float32) @ ancestors.astype(np.float32)) > 0
    follows = ~(ancestors.T | between | np.eye(n, dtype=bool))
    return Model(
        n,
        cost,
        before,
        first,
        ancestors,
        follows,
        [2 * int(s) + int(f) for s, f in data.get("initial") or []],
        float(data["time_limit_s"]),
    )


def write(
    model: Model, nodes: Iterable[int] | None, *, bound: float | None, proved: bool, version: str
) -> None:
    """The answer to stdout. ``bound`` is in scaled units; None where the solver has none that is valid."""
    # Each of the n - 1 rounded costs may be half a unit too long.
    lower = None if bound is None else max(0.0, (bound - 0.5 * model.n) / SCALE)
    answer: dict[str, Any] = {
        "order": None if nodes is None else [[node >> 1, bool(node & 1)] for node in nodes],
        "bound": lower,
        "proved": proved,
        "seconds": time.process_time(),
        "version": version,
    }
    json.dump(answer, sys.stdout)


def _closure(n: int, before: list[tuple[int, int]]) -> NDArray[np.bool_]:
    """bool (n, n): [a, b] where a chain of pairs leads from a to b."""
    under: list[list[int]] = [[] for _ in range(n)]
    above: list[list[int]] = [[] for _ in range(n)]
    for a, b in before:
        under[b].append(a)
        above[a].append(b)
    missing = [len(u) for u in under]
    ready = [s for s in range(n) if missing[s] == 0]
    reached = np.zeros((n, n), bool)  # [b, a]: a is somewhere below b
    while ready:
        b = ready.pop()
        for a in under[b]:
            reached[b] |= reached[a]
            reached[b, a] = True
        for c in above[b]:
            missing[c] -= 1
            if missing[c] == 0:
                ready.append(c)
    return reached.T.copy()
