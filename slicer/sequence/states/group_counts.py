"""Fewer states than down-sets: how many toolpaths of each group are printed, and not which.

Parallel lines that stand side by side can be printed in any order, so that the down-sets of a steep column
are too many to look at. Here such lines form a *group*, and what is printed of a column is a number for each
of its groups (state-space relaxation: Christofides, Mingozzi and Toth, "State-space relaxation procedures for
the computation of bounds to routing problems", Networks 11, 1981). A toolpath may come next where the numbers
leave room for all that must come before it, and for all that must come after it. Every sequence is a walk
through these states, but a walk may print one toolpath of a group twice and leave out another. So bounds
hold, and searches have no use for them. Where every group is one toolpath, or one on top of the other, they
are the down-sets.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.closure import Closure
from slicer.sequence.states.downsets import NOTHING_MORE, DownSets, all_down_sets
from slicer.sequence.states.section import NONE, Section

COUNTED = -1
"""``DownSets.corridor`` of a column whose states are counts."""
RUNS = (1_000_000, 5, 3, 2)
"""So many neighbouring parallel toolpaths make a group, from the coarsest."""
FEWEST_JOINED = 4
"""Families that stand on one another are joined down to so many, or else to one. Of two or three, most states
have two that are in part printed: over them the bound of ihc_8x8 is as often lower as higher than over one.
Fewer are a choice only where so many make too many states.
"""
MOST_STATES = 4_000
"""Finer counts of a column are not tried: numbering them takes longer than they are worth."""
LARGEST_NUMBER = 2**62
SAME_DIRECTION_DEG = 1e-4


class Relaxation(NamedTuple):
    """States of a column.

    Attributes:
        sets: they, as if they were down-sets.
        groups: int64 (n,), the group of each toolpath; None where they are down-sets.
        printed: int64 (d, g), how many of each group are printed; None likewise.
    """

    sets: DownSets
    groups: NDArray[np.int64] | None = None
    printed: NDArray[np.int64] | None = None


def coarse_relaxations(part: Section, closure: Closure, most: int) -> list[Relaxation]:
    """The states of a section of one column that are made quickly: counts of a single group, one state for
    each number of toolpaths, and the down-sets.

    Args:
        part: what is ordered, with a free end; see ``Section.part``.
        closure: what must come before what of it.
        most: down-sets, which come last, are no more than so many.
    """
    one = _counted(part, closure.before, np.zeros(part.n, np.int64), max(part.n + 1, MOST_STATES))
    assert one is not None  # there are no more states than toolpaths
    exact = all_down_sets(part, most)
    return [one] if exact is None else [one, Relaxation(exact)]


def relaxations(part: Section, closure: Closure, coarse: list[Relaxation]) -> list[Relaxation]:
    """The states of a section of one column, from the coarsest counts to the finest and to the down-sets.

    Groups are runs of parallel neighbours, or joined families of these, down to a single group, which comes
    first and is always there.

    Args:
        part, closure: see ``coarse_relaxations``.
        coarse: what that gives.
    """
    out = coarse[:1]
    for groups in _groupings(part.segments)[1:]:
        counted = _counted(part, closure.before, groups, max(part.n + 1, MOST_STATES))
        if counted is None:
            break
        if not np.array_equal(counted.sets.step_to, out[-1].sets.step_to):
            out.append(counted)
    if max(_count(states) for states in out) >= FEWEST_JOINED:
        out = [states for states in out if not 1 < _count(states) < FEWEST_JOINED]
    return out + coarse[1:]


def _count(states: Relaxation) -> int:
    """How many groups there are."""
    return 0 if states.groups is None else int(states.groups.max()) + 1


def with_what_follows(closure: Closure, states: Relaxation) -> DownSets:
    """The states, with what may come next where a toolpath was the last one, see ``DownSets.follows``.

    All that must come before either of the two is printed then, but for the second one, and nothing that must
    come after either. So a state has to have room for both, which is more than each needs alone.
    """
    sets, groups, printed = states
    steps, tops = np.diff(sets.step_start), np.diff(sets.top_start)
    state = np.repeat(np.arange(len(steps)), steps * tops)
    rank = np.arange(len(state)) - np.repeat(np.cumsum(steps * tops) - steps * tops, steps * tops)
    top, step = sets.top_start[state] + rank // steps[state], rank % steps[state]
    if groups is not None and printed is not None:
        last, after = sets.top_path[top], sets.step_path[sets.step_start[state] + step]
        before = closure.before
        same = np.eye(len(before), dtype=np.bool_)
        fits = ~closure.never[last, after]
        for g in range(int(groups.max()) + 1):
            own = groups == g
            done = _either((before | same)[own], before[own])[last, after]
            waiting = _either(before.T[own], (before | same).T[own])[last, after]
            fits &= (done <= printed[state, g]) & (printed[state, g] <= own.sum() - waiting)
        top, step = top[fits], step[fits]
    start = np.searchsorted(top, np.arange(len(sets.top_path) + 1)).astype(np.int32)
    return sets._replace(follow_start=start, follows=step.astype(np.int32))


def _either(of_last: NDArray[np.bool_], of_next: NDArray[np.bool_]) -> NDArray[np.int64]:
    """int64 (n, n), [a, b]: of how many toolpaths of a group, bool (g, n), a is true in the first or b in the
    second."""
    both = of_last.T.astype(np.float32) @ of_next.astype(np.float32)
    either = of_last.sum(axis=0)[:, None] + of_next.sum(axis=0)[None] - np.round(both)
    out: NDArray[np.int64] = either.astype(np.int64)
    return out


def _groupings(segments: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """int64 (n,), the group of each toolpath, from a single group to the smallest groups."""
    along = segments[:, 1] - segments[:, 0]
    angle = np.degrees(np.arctan2(along[:, 1], along[:, 0])) % 180.0
    direction = np.round(angle / SAME_DIRECTION_DEG).astype(np.int64) % round(180.0 / SAME_DIRECTION_DEG)
    middle = segments.mean(axis=1)
    turned = np.radians(direction * SAME_DIRECTION_DEG)
    aside = np.cos(turned) * middle[:, 1] - np.sin(turned) * middle[:, 0]
    _, family = np.unique(direction, return_inverse=True)
    by_family = np.lexsort((aside, family))
    ends = np.flatnonzero(np.diff(family[by_family])) + 1
    out: list[NDArray[np.int64]] = []
    for run in RUNS:
        groups, count = np.empty(len(segments), np.int64), 0
        for members in np.split(by_family, ends):
            for piece in np.array_split(members, max(1, round(len(members) / run))):
                groups[piece] = count
                count += 1
        out.append(groups)
    groups = out[0]
    while (count := int(groups.max()) + 1) > 1:
        height = np.bincount(groups, middle[:, 1]) / np.bincount(groups)
        rank = np.empty(count, np.int64)
        rank[np.argsort(height, kind="stable")] = np.arange(count)
        groups = rank[groups] // 2
        out.insert(0, groups)
    return out


def _counted(
    part: Section, before: NDArray[np.bool_], groups: NDArray[np.int64], limit: int
) -> Relaxation | None:
    """The states that some walk from nothing to everything passes; None if there are more than ``limit``."""
    n, first, count = part.n, part.first, int(groups.max()) + 1
    size = np.bincount(groups, minlength=count)
    # The numbers of all groups, as digits of one; in whole numbers, since floats round above 2^53.
    worth = [1]
    for members in size.tolist():
        worth.append(worth[-1] * (members + 1))
    if worth[-1] > LARGEST_NUMBER:
        return None
    weight = np.array(worth[:-1], np.int64)
    least = np.stack([before[groups == g].sum(axis=0) for g in range(count)])
    most = size[:, None] - np.stack([before[:, groups == g].sum(axis=1) for g in range(count)])
    most[groups, np.arange(n)] -= 1
    fewest, highest = least.sum(axis=0), most.sum(axis=0)
    widths, layers = [1], [np.zeros(1, np.int64)]
    steps = []  # of each layer: [state, toolpath, state of the next layer]
    now, total = np.zeros(1, np.int64), 1
    for m in range(n):
        may = (fewest <= m) & (m <= highest)
        if first != NONE:
            may &= (np.arange(n) == first) == (m == 0)
        paths = np.flatnonzero(may)
        fits = np.ones((len(now), len(paths)), np.bool_)
        for g in range(count):
            printed = (now // weight[g] % (size[g] + 1))[:, None]
            fits &= (least[g, paths] <= printed) & (printed <= most[g, paths])
        state, place = np.nonzero(fits)
        path = paths[place]
        after, to = np.unique(now[state] + weight[groups[path]], return_inverse=True)
        total += len(after)
        if total > limit:
            return None
        steps.append(np.stack([state, path, to]))
        widths.append(len(after))
        layers.append(after)
        now = after
    sets, kept = _numbered(n, widths, steps)
    code = np.concatenate([layer[alive] for layer, alive in zip(layers, kept, strict=True)])
    return Relaxation(sets, groups, code[:, None] // weight % (size + 1))


def _numbered(
    n: int, widths: list[int], steps: list[NDArray[np.int64]]
) -> tuple[DownSets, list[NDArray[np.bool_]]]:
    """Number the states layer by layer, without those from which not everything can be printed.

    Returns:
        them, and for each layer which states are left.
    """
    alive = np.ones(1, np.bool_)
    kept, numbers = [alive], []
    for m in range(n - 1, -1, -1):
        steps[m] = steps[m][:, alive[steps[m][2]]]
        alive = np.zeros(widths[m], np.bool_)
        alive[steps[m][0]] = True
        kept.append(alive)
    kept.reverse()
    begin = 0
    for alive in kept:
        numbers.append(np.cumsum(alive) - 1 + begin)
        begin += int(alive.sum())
    source = np.concatenate([numbers[m][steps[m][0]] for m in range(n)])
    path = np.concatenate([steps[m][1] for m in range(n)])
    to = np.concatenate([numbers[m + 1][steps[m][2]] for m in range(n)])
    # What can be the last toolpath of a state: whatever leads to it.
    tops, slot = np.unique(to * n + path, return_inverse=True)
    top_start = np.searchsorted(tops // n, np.arange(begin + 1))
    sets = DownSets(
        np.array([0, begin], np.int32),
        np.searchsorted(source, np.arange(begin + 1)).astype(np.int32),
        path.astype(np.int32),
        to.astype(np.int32),
        (slot.ravel() - top_start[to]).astype(np.int32),
        top_start.astype(np.int32),
        (tops % n).astype(np.int32),
        *NOTHING_MORE,
        np.arange(n, dtype=np.int32),
        np.array([n], np.int32),
        np.array([COUNTED], np.int32),
    )
    return sets, kept
