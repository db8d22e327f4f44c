"""What ``high`` adds where nothing is proved: annealing from several seeds, windows, and splice.

A cooled run of kicks and descent sees far but misses details, trees see a stretch, windows see all details of
little; all end in optima that differ from seed to seed, in one place for the better and in another for the
worse. Splice takes the best section of each. So a few sequences are annealed and polished apart from each
other; then rounds heat the best one again, and splice keeps of that what has become better.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.incumbent import Incumbent
from slicer.sequence.local import HEAT, budget, cooled
from slicer.sequence.method import Options
from slicer.sequence.neighbours import Neighbours
from slicer.sequence.problem import Problem
from slicer.sequence.splice import splice
from slicer.sequence.trees import STRIDE, improve_by_trees
from slicer.sequence.window import polish

STARTS = 3
"""Sequences that are annealed from the same start with different random numbers."""
ROUNDS = 5
START_SHARE, ROUND_SHARE, MILD_SHARE = 6, 28, 125
"""Parts of the kicks of ``budget``: that of each start, of each round, and of a round that is mild."""
REHEAT, MILD = 2.0, 0.3
"""Heat of the rounds, see ``HEAT``; mild where the large structure is to be kept."""
START_ROLLOUTS, ROUND_ROLLOUTS = 100, 30
"""Rollouts of each tree in a start and in a round."""
MOST_ROLLOUTS = 600_000
"""A toolpath of a large sheet gets no more of these than its part."""
START_WORK, ROUND_WORK = 3_000, 2_000
"""Work of the windows for each toolpath, see ``Ledger``, in each start and each round."""
POOL = 8
"""How many of the latest sequences splice may cross."""


class Deepening:
    """A run of ``deepen``: the sequences that splice may cross, and the windows that need no second look."""

    def __init__(
        self, problem: Problem, options: Options, near: Neighbours, incumbent: Incumbent, windows: bool
    ) -> None:
        self._problem, self._options, self._near = problem, options, near
        self._incumbent = incumbent
        self._windows = windows
        self._pool: deque[NDArray[np.int32]] = deque(maxlen=POOL)
        self._settled: set[bytes] = set()

    def anneal(self, start: NDArray[np.int32], kicks: int, heat: float, salt: int) -> NDArray[np.int32]:
        """A cooled run from a sequence; what it ends in may cost more, but the incumbent is told of all."""
        oriented = start
        for oriented in cooled(
            self._problem, self._options, self._near, start, kicks=kicks, heat=heat, salt=salt
        ):
            self._incumbent.offer(oriented)
            self._incumbent.report("annealing", bounded=False)
        return oriented

    def trees(self, oriented: NDArray[np.int32], rollouts: int, salt: int) -> NDArray[np.int32]:
        """A pass of tree search over a sequence."""
        rollouts = max(1, min(rollouts, STRIDE * MOST_ROLLOUTS // self._problem.n))
        return improve_by_trees(
            self._problem, self._options, self._near, self._incumbent, oriented, rollouts=rollouts, salt=salt
        )

    def polish(self, oriented: NDArray[np.int32], work: int) -> NDArray[np.int32]:
        """Windows over a sequence."""
        if not self._windows:
            return oriented
        polished = polish(
            self._problem, self._options, oriented, work=work * self._problem.n, settled=self._settled
        )
        self._incumbent.offer(polished)
        self._incumbent.report("windows", bounded=False)
        return polished

    def splice(self, oriented: NDArray[np.int32]) -> None:
        """Cross a sequence with the incumbent's and the latest ones."""
        self._pool.append(oriented)
        tours = [self._incumbent.oriented, *self._pool]
        self._incumbent.offer(splice(self._problem, self._options.objective, tours))
        self._incumbent.report("splice", bounded=False)


def deepen(
    problem: Problem,
    options: Options,
    near: Neighbours,
    incumbent: Incumbent,
    *,
    apart: bool,
    windows: bool,
) -> bool:
    """Anneal, polish and splice from the incumbent's sequence on; False where time ran out.

    Args:
        problem: what is ordered.
        options: seed, objective, deadline and progress.
        near: the candidates of the descent.
        incumbent: where the search starts, and what is offered the results.
        apart: whether the large structure is still to be found, by several runs from the same start. Else
            the rounds are mild.
        windows: whether the sheet is small enough for windows.
    """
    run = Deepening(problem, options, near, incumbent, windows)
    start = incumbent.oriented
    kicks = budget(problem.n, options.effort)
    starts, share, heat = (STARTS, ROUND_SHARE, REHEAT) if apart else (0, MILD_SHARE, MILD)
    for salt in range(1, starts + 1):
        found = run.anneal(start, kicks // START_SHARE, HEAT, salt)
        found = run.trees(found, START_ROLLOUTS, salt)
        run.splice(run.polish(found, START_WORK))
        if options.out_of_time():
            return False
    for salt in range(starts + 1, starts + ROUNDS + 1):
        found = run.anneal(incumbent.oriented, kicks // share, heat, salt)
        run.splice(run.trees(found, ROUND_ROLLOUTS, salt))
        run.polish(incumbent.oriented, ROUND_WORK)
        if options.out_of_time():
            return False
    return True
