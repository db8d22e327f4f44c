"""What ``high`` adds where nothing is proved: annealing from several seeds, windows, and tour merging.

An annealed run sees far but misses details, trees see a stretch, windows see all details of little; all end
in optima that differ from seed to seed, in one place for the better and in another for the worse. Merging
takes the best section of each. So a few sequences are annealed and polished apart from each other; then
rounds heat the best one again, and merging keeps of that what has become better.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.layered import merge_tours, window_search
from slicer.sequence.local_search import FIRST_TEMPERATURE, annealed, perturbation_budget
from slicer.sequence.problem import Search
from slicer.sequence.tree_search import STRIDE, improve_by_trees

STARTS = 3
"""Sequences that are annealed from the same start with different random numbers."""
ROUNDS = 5
START_SHARE, ROUND_SHARE, MILD_SHARE = 6, 28, 125
"""Parts of ``perturbation_budget``: that of each start, of each round, and of a round that is mild."""
REHEAT, MILD = 2.0, 0.3
"""Heat of the rounds, see ``FIRST_TEMPERATURE``; mild where the large structure is to be kept."""
START_ROLLOUTS, ROUND_ROLLOUTS = 100, 30
"""Rollouts of each tree in a start and in a round."""
MOST_ROLLOUTS = 600_000
"""A toolpath of a large sheet gets no more of these than its part."""
WINDOW_WORK, MOST_WINDOW_WORK = 20_000, 24_000_000
"""Work of the windows for each toolpath, see ``WorkBudget``, in each start and round, and of all at most.

With a tenth of it ihc_8x8 ends at 86.15 mm in 15.6 s, with this at 85.80 in 19.2.
"""
POOL = 8
"""How many of the latest sequences may be merged."""


class AnnealingRounds:
    """A run of ``anneal_and_merge``: the sequences to merge, and the windows that need no second look."""

    def __init__(self, search: Search, *, windows: bool) -> None:
        self._search = search
        self._windows = windows
        self._pool: deque[NDArray[np.int32]] = deque(maxlen=POOL)
        self._exhausted: set[bytes] = set()

    def anneal(
        self, start: NDArray[np.int32], perturbations: int, first_temperature: float, stream: int
    ) -> NDArray[np.int32]:
        """An annealed run from a sequence; its end may cost more, but all it passes is offered."""
        oriented = start
        for oriented in annealed(
            self._search,
            start,
            perturbations=perturbations,
            first_temperature=first_temperature,
            stream=stream,
        ):
            self._search.offer(oriented)
            self._search.report("annealing")
        return oriented

    def trees(self, oriented: NDArray[np.int32], rollouts: int, stream: int) -> NDArray[np.int32]:
        """A pass of tree search over a sequence."""
        rollouts = max(1, min(rollouts, STRIDE * MOST_ROLLOUTS // self._search.problem.n))
        return improve_by_trees(self._search, oriented, rollouts=rollouts, stream=stream)

    def window_search(self, oriented: NDArray[np.int32]) -> NDArray[np.int32]:
        """Windows over a sequence."""
        if not self._windows:
            return oriented
        work = min(WINDOW_WORK * self._search.problem.n, MOST_WINDOW_WORK)
        polished = window_search(self._search, oriented, work=work, exhausted=self._exhausted)
        self._search.offer(polished)
        self._search.report("windows")
        return polished

    def merge(self, oriented: NDArray[np.int32]) -> None:
        """Cross a sequence with the best one and the latest ones."""
        self._pool.append(oriented)
        tours = [self._search.oriented, *self._pool]
        self._search.offer(merge_tours(self._search.problem, self._search.objective, tours))
        self._search.report("tour merging")


def anneal_and_merge(search: Search, *, apart: bool, windows: bool) -> bool:
    """Anneal, search windows and merge tours from the best sequence on; False where time ran out.

    Args:
        search: where it starts, and what is offered the results.
        apart: whether the large structure is still to be found, by several runs from the same start. Else
            the rounds are mild.
        windows: whether the sheet is small enough for windows.
    """
    run = AnnealingRounds(search, windows=windows)
    start = search.oriented
    perturbations = perturbation_budget(search.problem.n, search.effort)
    starts, share, first_temperature = (STARTS, ROUND_SHARE, REHEAT) if apart else (0, MILD_SHARE, MILD)
    for stream in range(1, starts + 1):
        found = run.anneal(start, perturbations // START_SHARE, FIRST_TEMPERATURE, stream)
        found = run.trees(found, START_ROLLOUTS, stream)
        run.merge(run.window_search(found))
        if search.should_stop():
            return False
    for stream in range(starts + 1, starts + ROUNDS + 1):
        found = run.anneal(search.oriented, perturbations // share, first_temperature, stream)
        run.merge(run.trees(found, ROUND_ROLLOUTS, stream))
        run.window_search(search.oriented)
        if search.should_stop():
            return False
    return True
