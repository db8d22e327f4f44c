"""The public call of the sequencer: segments in, a ``Result`` out."""

import time

import numpy as np
from numpy.typing import ArrayLike

from slicer.errors import SequenceError
from slicer.sequence.beam import beam
from slicer.sequence.exact import exact
from slicer.sequence.greedy import greedy
from slicer.sequence.local import local
from slicer.sequence.method import Method, Options
from slicer.sequence.problem import Problem
from slicer.sequence.result import Result

METHODS: dict[str, Method] = {"greedy": greedy, "exact": exact, "beam": beam, "local": local}


def solve(
    segments: ArrayLike | Problem,
    *,
    first: int | None = 0,
    first_flipped: bool | None = None,
    method: str = "greedy",
    seed: int = 0,
) -> Result:
    """Order and orient toolpaths so that the nozzle travels little between them.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm; or a ``Problem``, whose own start then holds.
        first: index of the toolpath to begin with; None leaves the start free.
        first_flipped: whether the first toolpath is printed from its second endpoint; None leaves its
            direction free.
        method: one of ``METHODS``.
        seed: for methods that draw random numbers.

    Raises:
        CrossingError: two toolpaths cross or overlap.
        SequenceError: no such method, or ``first`` cannot be printed first.
    """
    if method not in METHODS:
        raise SequenceError(f"there is no method '{method}'; there are {', '.join(METHODS)}")
    problem = (
        segments
        if isinstance(segments, Problem)
        else Problem.build(segments, first=first, first_flipped=first_flipped)
    )
    begin = time.perf_counter()
    found = METHODS[method](problem, Options(seed=seed))
    order, flipped = (found.oriented >> 1).astype(np.int64), (found.oriented & 1).astype(np.bool_)
    return Result(
        order=order,
        flipped=flipped,
        travel_mm=problem.travel_mm(order, flipped),
        lower_bound_mm=0.0 if problem.n < 2 else found.lower_bound_mm,
        nodes_visited=found.nodes_visited,
        states_created=found.states_created,
        method=method,
        seed=seed,
        runtime_s=time.perf_counter() - begin,
    )
