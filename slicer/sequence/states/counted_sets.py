"""Fewer states than down-sets: how many toolpaths of each group are printed, and not which.

Parallel lines that stand side by side can be printed in any order, so that the down-sets of a steep column are
too many to look at. Here such lines form a *group*, and what is printed of a column is a number for each of its
groups (state-space relaxation: Christofides, Mingozzi and Toth, "State-space relaxation procedures for the
computation of bounds to routing problems", Networks 11, 1981). A toolpath may come next where the numbers leave
room for all that must come before it, and for all that must come after it. Every sequence is a walk through these
states, but a walk may print one toolpath of a group twice and leave out another. So bounds hold, and searches
have no use for them. Where every group is one toolpath, or one on top of the other, they are the down-sets.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.downsets import UNLIMITED, DownSets, all_down_sets
from slicer.sequence.states.section import NONE, Section

COUNTED = -1
"""``DownSets.corridor`` of a column whose states are counts."""
RUNS = (2, 3, 5, 1_000_000)
"""So many neighbouring parallel toolpaths make a group, tried from the finest."""
SAME_DIRECTION_DEG = 1e-4


def counted_sets(section: Section, limit: int) -> DownSets:
    """The down-sets of each column, or counts of them where it has more than ``limit``.

    Groups are as small as the limit allows; where even those of all parallel neighbours are too many, they are
    joined from the bottom up, down to a single group, which has one state for each number of toolpaths.

    Args:
        section: what is ordered, with a free end; rows of its precedence between columns are not seen.
        limit: the most states of a column, if it has not more toolpaths than that.
    """
    parts = []
    for c in range(section.columns):
        paths = np.flatnonzero(section.column == c).astype(np.int32)
        parts.append((paths, _of_column(section.part(section.column == c), limit)))
    return _joined(section.n, parts)


def _of_column(part: Section, limit: int) -> DownSets:
    """The states of a section of one column."""
    limit = max(limit, part.n + 2)
    sets = all_down_sets(part, limit)
    if sets is not None:
        return sets
    order = _before(part)
    for groups in _groupings(part.segments):
        counted = _counted(part, order, groups, limit)
        if counted is not None:
            return counted
    raise AssertionError("a single group has one state for each number of toolpaths")


def never_follows(part: Section) -> NDArray[np.bool_]:
    """bool (n, n), [a, b]: no sequence prints b directly after a; of a section of one column."""
    before = _before(part)
    between = (before.astype(np.float32) @ before.astype(np.float32)) > 0.5
    never: NDArray[np.bool_] = before.T | between
    np.fill_diagonal(never, True)
    return never


def _before(part: Section) -> NDArray[np.bool_]:
    """bool (n, n), [a, b]: a must come before b."""
    n = part.n
    before = np.zeros((n, n), np.bool_)
    missing = np.diff(part.pred_start)
    ready = np.flatnonzero(missing == 0).tolist()
    while ready:
        s = ready.pop()
        under = part.pred[part.pred_start[s] : part.pred_start[s + 1]]
        before[:, s] = before[:, under].any(axis=1)
        before[under, s] = True
        for t in part.succ[part.succ_start[s] : part.succ_start[s + 1]].tolist():
            missing[t] -= 1
            if missing[t] == 0:
                ready.append(t)
    return before


def _groupings(segments: NDArray[np.float64]) -> "list[NDArray[np.int64]]":
    """int64 (n,), the group of each toolpath, from the finest grouping to the coarsest."""
    along = segments[:, 1] - segments[:, 0]
    angle = np.degrees(np.arctan2(along[:, 1], along[:, 0])) % 180.0
    direction = np.round(angle / SAME_DIRECTION_DEG).astype(np.int64) % round(180.0 / SAME_DIRECTION_DEG)
    middle = segments.mean(axis=1)
    turned = np.radians(direction * SAME_DIRECTION_DEG)
    aside = np.cos(turned) * middle[:, 1] - np.sin(turned) * middle[:, 0]
    _, family = np.unique(direction, return_inverse=True)
    out = []
    for run in RUNS:
        groups = np.empty(len(segments), np.int64)
        count = 0
        for f in range(int(family.max()) + 1):
            members = np.flatnonzero(family == f)
            members = members[np.argsort(aside[members], kind="stable")]
            for piece in np.array_split(members, max(1, round(len(members) / run))):
                groups[piece] = count
                count += 1
        out.append(groups)
    while count > 1:
        height = np.bincount(groups, middle[:, 1]) / np.bincount(groups)
        rank = np.empty(count, np.int64)
        rank[np.argsort(height, kind="stable")] = np.arange(count)
        groups = rank[groups] // 2
        count = int(groups.max()) + 1
        out.append(groups)
    return out


def _counted(
    part: Section, before: NDArray[np.bool_], groups: NDArray[np.int64], limit: int
) -> DownSets | None:
    """The states that some walk from nothing to everything passes; None where there are more than ``limit``."""
    n, count = part.n, int(groups.max()) + 1
    size = np.bincount(groups, minlength=count)
    least = np.stack([before[groups == g].sum(axis=0) for g in range(count)], axis=1)
    most = size - np.stack([before[:, groups == g].sum(axis=1) for g in range(count)], axis=1)
    most[np.arange(n), groups] -= 1
    grows = np.zeros((n, count), np.int64)
    grows[np.arange(n), groups] = 1
    layers = [np.zeros((1, count), np.int64)]
    steps: list[NDArray[np.int64]] = []  # of each layer: [state, toolpath, state of the next layer]
    total = 1
    for m in range(n):
        now = layers[-1]
        fits = np.ones((len(now), n), np.bool_)
        for g in range(count):
            fits &= (least[:, g] <= now[:, g, None]) & (now[:, g, None] <= most[:, g])
        if part.first != NONE:
            fits[:, np.arange(n) != part.first] &= m > 0
            fits[:, part.first] &= m == 0
        state, path = np.nonzero(fits)
        after, to = np.unique(now[state] + grows[path], axis=0, return_inverse=True)
        total += len(after)
        if total > limit:
            return None
        layers.append(after)
        steps.append(np.stack([state, path, to.ravel()]))
    return _numbered(n, [len(layer) for layer in layers], steps)


def _numbered(n: int, widths: list[int], steps: list[NDArray[np.int64]]) -> DownSets:
    """Number the states layer by layer, without those from which not everything can be printed."""
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
    return DownSets(
        np.array([0, begin], np.int32),
        np.searchsorted(source, np.arange(begin + 1)).astype(np.int32),
        path.astype(np.int32),
        to.astype(np.int32),
        (slot.ravel() - top_start[to]).astype(np.int32),
        top_start.astype(np.int32),
        (tops % n).astype(np.int32),
        np.arange(n, dtype=np.int32),
        np.array([n], np.int32),
        np.array([COUNTED], np.int32),
    )


def _joined(n: int, parts: list[tuple[NDArray[np.int32], DownSets]]) -> DownSets:
    """The states of all columns, each with its toolpaths, numbered through."""
    local = np.empty(n, np.int32)
    for paths, sets in parts:
        local[paths] = sets.local
    ends = np.cumsum([[0, 0, 0]] + [[sets.start[-1], sets.step_start[-1], sets.top_start[-1]] for _, sets in parts], axis=0)
    moved = list(zip(parts, ends[:-1].tolist(), strict=True))
    last = ends[-1]
    return DownSets(
        ends[:, 0].astype(np.int32),
        np.append(np.concatenate([s.step_start[:-1] + at[1] for (_, s), at in moved]), last[1]).astype(np.int32),
        np.concatenate([p[s.step_path] for (p, s), _ in moved]).astype(np.int32),
        np.concatenate([s.step_to + at[0] for (_, s), at in moved]).astype(np.int32),
        np.concatenate([s.step_slot for _, s in parts]).astype(np.int32),
        np.append(np.concatenate([s.top_start[:-1] + at[2] for (_, s), at in moved]), last[2]).astype(np.int32),
        np.concatenate([p[s.top_path] for (p, s), _ in moved]).astype(np.int32),
        local,
        np.array([len(p) for p, _ in parts], np.int32),
        np.concatenate([s.corridor for _, s in parts]).astype(np.int32),
    )
