"""Objectives that depend on what is printed at each moment, served by methods that do not look at it.

What a travel costs over the skyline depends on all that was printed before. Greedy, local search, trees and
ants see the straight travel instead, once by its length and once by its time; what they find is refined by
the true cost of either kind. (Exact, beam and windows carry the skyline when they work for time.)
All of these are candidates whatever the goal, so that no objective is served worse than by optimising
another one. Where little time is given, the goal's own kind comes first.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.construct import hill_climbs
from slicer.sequence.layered import window_search
from slicer.sequence.local_search import refine
from slicer.sequence.problem import Found, Method, ObjectiveName, Options, Problem, Progress, true_cost

SURROGATES: tuple[ObjectiveName, ...] = ("straight", "time")
"""Objectives that do not need the skyline, or are taken without it."""
SKYLINE_GOALS: tuple[ObjectiveName, ...] = ("routed", "time")
WINDOW_WORK = {"quick": 1_000, "default": 5_000, "high": 15_000}
"""Work of the windows for each toolpath, see ``WorkBudget``."""
FIRST_SHARE = 0.5
"""Of a time limit, what the first search may take, so that something is left to refine what it finds."""


def search_by_surrogates(
    problem: Problem,
    method: Method,
    carrying: Method | None,
    options: Options,
    *,
    refined: bool,
    windows: bool,
) -> Found:
    """Serve a routed objective.

    Args:
        problem: at least two toolpaths.
        method: what finds sequences by straight travel.
        carrying: a method that knows in each state what is printed, to be run in the end; or None.
        options: whose objective is routed.
        refined: whether what is found is refined; otherwise the method finds the same by either kind.
        windows: whether windows, which carry the skyline, go over it before and after.
    """
    own: ObjectiveName = "time" if options.objective.name == "time" else "straight"
    surrogates: list[ObjectiveName] = [own]
    if refined:
        surrogates += [name for name in SURROGATES if name != own]
    start = options.initial if options.initial is not None else next(hill_climbs(problem, options)).oriented
    best = _Best(problem, options, start)
    found: list[Found] = []
    stopped = proved = False
    try:
        for name in surrogates:
            inner = replace(options, objective=replace(options.objective, name=name))
            if options.deadline is not None and not found:
                now = time.perf_counter()
                inner = replace(inner, deadline=now + FIRST_SHARE * (options.deadline - now))
            one = method(problem, replace(inner, progress=best.listener(name)))
            found.append(one)
            best.offer(one.oriented)
            if one.stopped and (inner.deadline is None or time.perf_counter() < inner.deadline):
                raise KeyboardInterrupt  # which the method has answered
            for goal in SKYLINE_GOALS if refined else ():
                aim = replace(options, objective=replace(options.objective, name=goal), progress=None)
                for better in _refined(problem, aim, one.oriented, windows=windows):
                    best.offer(better)
                    best.report("true travels")
            stopped = one.stopped or options.out_of_time()
            proved = proved or (one.proved and name == options.objective.name)
            if stopped:
                break
        if carrying is not None and not stopped and not proved:
            # States know what is printed, so these methods see the true cost of every travel.
            last = replace(
                options.starting_from(best.oriented), progress=best.listener(options.objective.name)
            )
            found.append(carrying(problem, last))
            best.offer(found[-1].oriented)
            stopped = found[-1].stopped
    except KeyboardInterrupt:
        stopped = True
    bounds = [one.lower_bound_mm for one in found if one.lower_bound_mm is not None]
    return Found(
        best.oriented,
        sum(one.nodes_visited for one in found),
        sum(one.states_created for one in found),
        max(bounds, default=None),
        stopped or options.out_of_time(),
    )


def _refined(
    problem: Problem, options: Options, oriented: NDArray[np.int32], *, windows: bool
) -> Iterator[NDArray[np.int32]]:
    """A sequence improved by the true cost of its travels, step by step.

    Windows find what exchanges do not and the other way round: on ihc_8x8 exchanges alone end at 35.5 s of
    travel, with windows after them at 33.0, before them at 32.6, and before and after at 31.9.
    """
    work = WINDOW_WORK[options.effort] * problem.n
    if windows:
        yield (oriented := window_search(problem, options, oriented, work=work))
    yield (oriented := refine(problem, options, oriented))
    if windows:
        yield window_search(problem, options, oriented, work=work)


class _Best:
    """The sequence of the least true cost so far, and who is told about it."""

    def __init__(self, problem: Problem, options: Options, oriented: NDArray[np.int32]) -> None:
        self._problem, self._options = problem, options
        self.oriented = oriented
        self._cost = true_cost(problem, options.objective, oriented)
        self._bound = 0.0

    def offer(self, oriented: NDArray[np.int32]) -> None:
        """Take a sequence if it is cheaper."""
        cost = true_cost(self._problem, self._options.objective, oriented)
        if cost < self._cost:
            self.oriented, self._cost = oriented, cost

    def report(self, stage: str, bound: float | None = None) -> None:
        """Say how things stand, in the goal's own unit."""
        if bound is not None:
            self._bound = max(self._bound, min(bound, self._cost))
        if self._options.progress is not None:
            known = self._bound if bound is not None else None
            self._options.progress(Progress(stage, self._cost, known, self.oriented))

    def listener(self, name: ObjectiveName) -> Callable[[Progress], None]:
        """Hears from a method that works for ``name``, and passes on what it means for the goal."""
        goal = self._options.objective.name
        same_unit = (name == "time") == (goal == "time")  # then a bound on direct travels holds for the goal
        heard = np.inf

        def listen(word: Progress) -> None:
            nonlocal heard
            if word.oriented is not None and word.cost < heard:
                heard = word.cost
                self.offer(word.oriented)
            self.report(word.stage, word.lower_bound if same_unit else None)

        return listen
