"""Objectives that depend on what is printed at each moment, served by methods that do not look at it.

What a travel costs over the skyline depends on all that was printed before. Greedy, local search, trees and
ants see the straight travel instead, once by its length and once by its time; what they find is refined by
its true cost. (Exact, beam and windows carry the skyline when they work for time.)
Where little time is given, the goal's own kind comes first. Where that one has a bound, the
other one takes more seconds than it brings (on muscle_us_8x8 and dti 10x10 nothing, on 10x10_s1 0.8 s of
travel in 26 s), so only "high" looks there; and what follows is done where the bound leaves enough to gain.
Where down-sets are too many to be enumerated, or toolpaths for a beam to see far, nothing sees walls before
the refinement, and sequences that are short by length are the better ones to refine: ihc_8x8 comes to 32.3 s
of travel by length alone or with the other kind beside it, which takes three times as long, and to 35.5 by
direct time. Refinement gains more per second there than a longer search by length: on 20x20 tiles that one
saves 7 s of travel in 47 s of work.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import raise_relaxed_bound
from slicer.sequence.construct import hill_climbs
from slicer.sequence.layered import window_search
from slicer.sequence.local_search import refine
from slicer.sequence.portfolio.automatic import enumerable
from slicer.sequence.problem import Method, ObjectiveName, Search

SURROGATES: tuple[ObjectiveName, ...] = ("straight", "time")
"""Objectives that do not need the skyline, or are taken without it."""
WINDOW_WORK = {"quick": 1_000, "default": 14_000, "high": 20_000}
"""Work of the windows for each toolpath, see ``WorkBudget``."""
REFINE_S = 5e-3
"""Seconds that windows and exchanges by the true cost take for each toolpath."""
OWN_UP_TO = 1_400
"""Toolpaths up to which a bound by the goal's own cost guides a beam well enough: 10x10 tiles end at 46.8 s
of travel so and at 47.4 s from the shortest sequence, 20x20 at 205 and 191 s.
"""
FIRST_SHARE = 0.5
"""Of a time limit, what the first search may take, so that something is left to refine what it finds."""


def search_by_surrogates(
    search: Search,
    method: Method,
    carrying: Method | None,
    *,
    refined: bool,
    windows: bool,
    enumerating: bool = False,
) -> None:
    """Serve a routed objective.

    Args:
        search: for at least two toolpaths, whose objective is routed.
        method: what finds sequences by straight travel.
        carrying: a method that knows in each state what is printed, to be run in the end; or None.
        refined: whether what is found is refined; otherwise the method finds the same by either kind.
        windows: whether windows, which carry the skyline, go over it before and after.
        enumerating: whether the method enumerates down-sets where that can be done.
    """
    own: ObjectiveName = "time" if search.objective.unit == "s" else "straight"
    surrogates: list[ObjectiveName] = [own]
    effort, carried = search.effort, np.inf
    if not search.started:
        search.offer(next(hill_climbs(search)).oriented)
    if enumerating and (search.problem.n > OWN_UP_TO or not enumerable(search)):
        surrogates = ["straight"]
        effort = "quick" if effort == "default" else effort
    elif refined:
        surrogates += [name for name in SURROGATES if name != own]
    for k, name in enumerate(surrogates):
        inner = search.surrogate(name, share=1.0 if k else FIRST_SHARE, effort=effort)
        try:
            method(inner)
        finally:  # what it has found before Ctrl-C came
            search.absorb(inner.outcome())
        if inner.objective == search.objective:
            carried = inner.cost
        # A proof needs a good sequence, whatever that takes.
        pays = carrying is not None or search.pays(REFINE_S * search.problem.n)
        if refined and pays:
            aim = search.surrogate(search.objective.name)
            for better in _refined(aim, inner.oriented, windows=windows):
                search.offer(better)
                search.report("true travels")
        if inner.stopped or search.should_stop():
            return
        if search.near_enough or (name == own and inner.lower_bound > 0.0 and search.effort != "high"):
            break  # see above
    # States know what is printed, so the carrying method sees the true cost of every travel. Where the goal
    # itself was searched, the method has come to it already, and once more pays only from a better sequence.
    # Whoever asks for it by name wants its proof.
    if carrying is not None and search.cost < carried and (carrying is method or not search.near_enough):
        carrying(search)
    if refined:
        raise_relaxed_bound(search)


def _refined(aim: Search, oriented: NDArray[np.int32], *, windows: bool) -> Iterator[NDArray[np.int32]]:
    """A sequence improved by the true cost of its travels, step by step.

    Windows find what exchanges do not and the other way round: on ihc_8x8 exchanges alone end at 35.5 s of
    travel, with windows after them at 33.0, before them at 32.6, and before and after at 31.9.
    """
    work = WINDOW_WORK[aim.effort] * aim.problem.n
    if windows:
        yield (oriented := window_search(aim, oriented, work=work))
    yield (oriented := refine(aim, oriented))
    if windows:
        yield window_search(aim, oriented, work=work)
