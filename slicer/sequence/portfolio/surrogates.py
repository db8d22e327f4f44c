"""Objectives that depend on what is printed at each moment, served by methods that do not look at it.

What a travel costs over the skyline depends on all that was printed before. Greedy, local search, trees and
ants see the straight travel instead, once by its length and once by its time; what they find is refined by
its true cost. (Exact, beam and windows carry the skyline when they work for time.)
Where little time is given, the goal's own kind comes first, up to so many toolpaths as a proof is tried for.
Where that one has a bound, the other one takes more seconds than it brings, so only "high" looks there; and
what follows is done where the bound leaves enough to gain.
The bound by time leads beams badly on more than that, while that by length is tight: beams over a sheet that
is stretched until a short way up it is as long as it is dear end at 193 s of travel on 20x20 tiles, which
windows and exchanges bring to 181.5; from the shortest sequence of the sheet as it is they come to 184.1, and
from beams by time to 195 and more. Where down-sets are too many to be enumerated nothing sees walls before
the refinement, and sequences that are short by length are the better ones to refine: ihc_8x8 comes to 32.3 s
of travel by length alone or with the other kind beside it, which takes three times as long, and to 35.5 by
direct time, and stretching brings nothing. Refinement gains more per second than a longer search by length.
"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import is_streamable, raise_relaxed_bound
from slicer.sequence.construct import hill_climbs, start_along_levels
from slicer.sequence.layered import beam, streamed_beam, window_search
from slicer.sequence.local_search import anneal, refine
from slicer.sequence.portfolio.automatic import CARRY_UP_TO, MILD, enumerable
from slicer.sequence.problem import Method, ObjectiveName, Search, direct_cost, pitch

SURROGATES: tuple[ObjectiveName, ...] = ("straight", "time")
"""Objectives that do not need the skyline, or are taken without it."""
WINDOW_WORK = {"quick": 1_000, "default": 18_000, "high": 20_000}
"""Work of the windows for each toolpath, see ``WorkBudget``."""
REFINE_S = 3e-3
"""Seconds that windows and exchanges by the true cost take for each toolpath."""
OWN_UP_TO = 1_400
"""Toolpaths up to which a bound by the goal's own cost leads a beam well enough to look below what is known,
and where columns are tied to begin with.
"""
MOST_UPWARDS = 8.0
"""No sheet is stretched by more, nor pressed together by more."""
SETTLE = 5
"""Kicks for each toolpath after beams: on 40x40 tiles these save 7 s of 733 in less than one."""
FIRST_SHARE = 0.5
"""Of a time limit, what the first search may take, so that something is left to refine what it finds."""


class Stage(NamedTuple):
    """A search for good sequences by a cost that does not look at what is printed.

    Attributes:
        objective: what it is for.
        method: what searches.
        effort: of that search.
        upwards: how many times the sheet is stretched.
        onward: what searches by the true cost while what is found is refined; or None.
    """

    objective: ObjectiveName
    method: Method
    effort: str
    upwards: float = 1.0
    onward: Method | None = None


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
    carried = np.inf
    if not search.started:
        search.offer(next(hill_climbs(search)).oriented)
    for k, stage in enumerate(_stages(search, method, refined=refined, enumerating=enumerating)):
        inner = search.surrogate(
            stage.objective, share=1.0 if k else FIRST_SHARE, effort=stage.effort, upwards=stage.upwards
        )
        try:
            stage.method(inner)
        finally:  # what it has found before Ctrl-C came
            search.absorb(inner.outcome())
        if inner.objective == search.objective:
            carried = inner.cost
        # A proof needs a good sequence, whatever that takes.
        pays = carrying is not None or search.pays(REFINE_S * search.problem.n)
        if refined and pays and not search.proved:
            for better in _refined(search, inner.oriented, stage, windows=windows):
                search.offer(better)
                search.report("true travels")
        if inner.stopped or search.should_stop():
            return
        if search.near_enough or (search.lower_bound > 0.0 and search.effort != "high"):
            break  # see above
    # States know what is printed, so the carrying method sees the true cost of every travel. Where the goal
    # itself was searched, the method has come to it already, and once more pays only from a better sequence.
    # Whoever asks for it by name wants its proof.
    if carrying is not None and search.cost < carried and (carrying is method or not search.near_enough):
        carrying(search)
    if refined:
        raise_relaxed_bound(search)


def _stages(search: Search, method: Method, *, refined: bool, enumerating: bool) -> Iterator[Stage]:
    """What is searched, one after the other, as long as the caller asks for more."""
    effort, problem = search.effort, search.problem
    own = search.objective.searched_as
    if not enumerating:
        names = [own] + [name for name in SURROGATES if refined and name != own]
        yield from (Stage(name, method, effort) for name in names)
        return
    first = problem.n <= (CARRY_UP_TO[effort] if problem.planar else OWN_UP_TO) and enumerable(search)
    if first:
        yield Stage(own, method, effort)
    if problem.planar and is_streamable(search):
        led = method if effort == "high" else partial(_beams, otherwise=method)
        onward = beam if not first and effort == "default" and problem.n <= OWN_UP_TO else None
        yield Stage("straight", led, effort, _upwards(search), onward)
    else:
        yield Stage("straight", method, "quick" if effort == "default" else effort)


def _upwards(search: Search) -> float:
    """How many times more a short travel costs up the sheet than across it."""
    cost_model, hop = search.objective.cost_model, pitch(search.problem)
    up, across = direct_cost(cost_model, 0.0, hop), direct_cost(cost_model, hop, 0.0)
    return float(np.clip(up / across, 1.0 / MOST_UPWARDS, MOST_UPWARDS))


def _beams(search: Search, *, otherwise: Method) -> None:
    """What beams find, and local search for where they have left toolpaths behind; windows follow.

    Where beams cannot look, or find nothing, another method is taken.
    """
    start_along_levels(search)
    begun = search.cost
    if streamed_beam(search, loose=True) is not None and search.cost < begun:
        anneal(search, perturbations=SETTLE * search.problem.n, first_temperature=MILD)
    elif not search.should_stop():
        search.effort = "quick"
        otherwise(search)


def _refined(
    search: Search, oriented: NDArray[np.int32], stage: Stage, *, windows: bool
) -> Iterator[NDArray[np.int32]]:
    """A sequence improved by the true cost of its travels, step by step.

    Windows find what exchanges do not and the other way round: on ihc_8x8 exchanges alone end at 35.5 s of
    travel, with windows after them at 33.0, before them at 32.6, and before and after at 31.9.
    """
    aim = search.surrogate(search.objective.name)
    work = WINDOW_WORK[search.effort] * aim.problem.n
    if windows:
        yield (oriented := window_search(aim, oriented, work=work))
    yield (oriented := refine(aim, oriented))
    if stage.onward is not None:
        stage.onward(search)
        oriented = search.oriented
    if windows and not search.proved:
        # Under a body windows take twice as long: ihc_8x8 in 4850 pieces comes to 572 s of travel in 34 s
        # and to 565 in 46. For a point they win back what they take.
        yield window_search(aim, oriented, work=work, thrifty=not aim.problem.body.is_point)
