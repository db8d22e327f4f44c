"""The source paper's hill climbing: always go to the nearest endpoint of a printable toolpath.

The paper's value function V = m·w·s·√2 − d_prior prefers more printed toolpaths m, and among states with
the same m the shorter last travel d_prior; since each step prints one toolpath, that is the nearest
endpoint (section 4, "Toolpath Generation Approach").
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.problem import Search

NONE = -1


class Climb(NamedTuple):
    """One run of hill climbing.

    Attributes:
        travel_mm: its straight travel.
        oriented: int32 (n,), the sequence of oriented toolpaths.
        states: states created.
    """

    travel_mm: float
    oriented: NDArray[np.int32]
    states: int


def greedy(search: Search) -> None:
    """Hill climbing from each start that the problem allows; the one with the least travel is kept.

    Counts as the paper's Table 1 does, and the aima-python framework under it: every state whose
    successors are asked for is a node visited, the complete one included, and every printable toolpath
    at such a state gives two states created, one where its direction is not free. The counts are of the run
    that is kept.
    """
    least, states = np.inf, 0
    for run in hill_climbs(search):
        if run.travel_mm < least:
            least, states = run.travel_mm, run.states
            search.offer(run.oriented)
            search.report("starts")
    search.nodes_visited += search.problem.n
    search.states_created += states


def hill_climbs(search: Search) -> Iterator[Climb]:
    """Climb from each start until time runs out, once at least."""
    problem = search.problem
    for count, start in enumerate(problem.starts):
        if count and search.should_stop():
            return
        oriented, states = hill_climb(
            problem.segments,
            problem.allowed,
            problem.pred_start,
            problem.succ_start,
            problem.succ,
            int(start),
            NONE,
        )
        yield Climb(problem.travel_mm(oriented >> 1, oriented & 1), oriented, states)


@kernel
def hill_climb(
    segments: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    pred_start: NDArray[np.int32],
    succ_start: NDArray[np.int32],
    succ: NDArray[np.int32],
    start: int,
    second: int,
) -> tuple[NDArray[np.int32], int]:
    """One run from the oriented toolpath ``start``: the sequence of oriented toolpaths, and states created.

    ``second`` is the oriented toolpath that follows, or ``NONE`` for the nearest.

    Printable toolpaths never share an open range of x, or one would lie below the other. So their
    endpoints lie along x, and strips of x hold few each: the nearest is found by going outwards from the
    nozzle's strip until the strips are farther away than the best endpoint seen.
    """
    n = len(segments)
    left = right = segments[0, 0, 0]
    for s in range(n):
        left = min(left, segments[s, 0, 0], segments[s, 1, 0])
        right = max(right, segments[s, 0, 0], segments[s, 1, 0])
    width = right - left
    strips = max(1, int(4 * np.sqrt(n)))
    scale = strips / width if width > 0 else 0.0
    head = np.full(strips, NONE, np.int32)  # doubly linked lists of oriented toolpaths by strip of entry
    after = np.full(2 * n, NONE, np.int32)
    before = np.full(2 * n, NONE, np.int32)
    missing = np.empty(n, np.int32)  # rows of the precedence whose earlier toolpath is not printed yet
    ready = np.empty(n, np.int32)
    count = 0
    for s in range(n):
        missing[s] = pred_start[s + 1] - pred_start[s]
        if missing[s] == 0:
            ready[count] = s
            count += 1
    sequence = np.empty(n, np.int32)
    printable = 0
    states = 0
    u = start
    for k in range(n):
        for t in range(count):  # what has become printable enters its strips
            for f in range(2):
                if not allowed[ready[t], f]:
                    continue
                v = 2 * ready[t] + f
                printable += 1
                strip = min(strips - 1, int((segments[ready[t], f, 0] - left) * scale))
                after[v], before[v] = head[strip], NONE
                if head[strip] != NONE:
                    before[head[strip]] = v
                head[strip] = v
        count = 0
        if k > 0:
            states += printable
            if k == 1 and second != NONE:
                u = second
            else:
                u = _nearest(segments, head, after, segments[u >> 1, 1 - (u & 1)], left, scale)
        s = u >> 1
        sequence[k] = u
        for f in range(2):
            if not allowed[s, f]:
                continue
            v = 2 * s + f
            printable -= 1
            if before[v] != NONE:
                after[before[v]] = after[v]
            else:
                head[min(strips - 1, int((segments[s, f, 0] - left) * scale))] = after[v]
            if after[v] != NONE:
                before[after[v]] = before[v]
        for t in range(succ_start[s], succ_start[s + 1]):
            missing[succ[t]] -= 1
            if missing[succ[t]] == 0:
                ready[count] = succ[t]
                count += 1
    return sequence, states


@inner_kernel
def _nearest(
    segments: NDArray[np.float64],
    head: NDArray[np.int32],
    after: NDArray[np.int32],
    nozzle: NDArray[np.float64],
    left: float,
    scale: float,
) -> int:
    """The oriented toolpath in the strips whose entry is nearest to the nozzle, the lowest number first."""
    strips = len(head)
    middle = min(strips - 1, int((nozzle[0] - left) * scale))
    best, nearest = np.inf, NONE
    for away in range(strips):
        # No x of a strip `away` steps off is nearer than this.
        if scale > 0 and ((away - 1) / scale) ** 2 > best:
            break
        for side in range(2):
            strip = middle - away if side == 0 else middle + away
            if strip < 0 or strip >= strips or (side == 1 and away == 0):
                continue
            v = head[strip]
            while v != NONE:
                dx = segments[v >> 1, v & 1, 0] - nozzle[0]
                dy = segments[v >> 1, v & 1, 1] - nozzle[1]
                d = dx * dx + dy * dy
                if d < best or (d == best and v < nearest):
                    best, nearest = d, v
                v = after[v]
    return nearest
