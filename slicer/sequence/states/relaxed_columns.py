"""The finest states of all columns that a bound can afford: down-sets where these are few, else counts."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.corridor import extent, pairs_of
from slicer.sequence.states.downsets import DownSets, all_down_sets
from slicer.sequence.states.group_counts import relaxations, with_what_follows
from slicer.sequence.states.section import Section

MOST_FOLLOWING = 4_000_000
"""What may follow is told of each end and step of a column's states, at 100 bytes each while it is found."""
MOST_DOWN_SETS = 6_000
"""A column with more has too many to be worth their numbering."""


def relaxed_sets(section: Section, most_arcs: int, too_many: float = np.inf) -> tuple[DownSets, int] | None:
    """States of each column, and how many travels the bound over pairs of columns then looks at.

    None where there are too many.

    Where ``most_arcs`` allows all down-sets, these are it. Else all columns begin with what makes the whole
    cheapest; then, as long as ``most_arcs`` allow, the step to a
    finer column that costs least is taken. Finer states are often cheaper: what can come next is less.

    Args:
        section: what is ordered, with a free end; rows of its precedence between columns are not seen.
        most_arcs: as many travels, if there is any such choice.
        too_many: with more travels there is no such bound.
    """
    whole = all_down_sets(section, MOST_DOWN_SETS)
    if whole is not None:  # nothing is finer
        arcs = extent(whole, pairs_of(section))[1]
        if arcs <= most_arcs:
            return whole, arcs
    paths = [np.flatnonzero(section.column == c).astype(np.int32) for c in range(section.columns)]
    parts = [section.part(section.column == c) for c in range(section.columns)]
    choices = [relaxations(part, MOST_DOWN_SETS) for part in parts]
    sizes = [[_size(states.sets) for states in column] for column in choices]
    chosen = [0] * section.columns
    arcs = _arcs(sizes, chosen)
    while True:  # cheaper
        trials = [(_arcs(sizes, trial), trial) for trial in _others(sizes, chosen)]
        cost, trial = min(trials, default=(arcs, chosen))
        if cost >= arcs:
            break
        arcs, chosen = cost, trial
    while True:  # finer
        trials = [
            (_arcs(sizes, trial), trial) for trial in _others(sizes, chosen) if sum(trial) > sum(chosen)
        ]
        cost, trial = min(trials, default=(most_arcs + 1, chosen))
        if cost > most_arcs:
            break
        arcs, chosen = cost, trial
    if arcs > too_many or max(column[t][3] for column, t in zip(sizes, chosen, strict=True)) > MOST_FOLLOWING:
        return None
    best = [
        with_what_follows(part, column[t]) for part, column, t in zip(parts, choices, chosen, strict=True)
    ]
    return _joined(section.n, paths, best), arcs


def _others(sizes: list[list[NDArray[np.int64]]], chosen: list[int]) -> list[list[int]]:
    """All choices that differ in one column."""
    return [
        [*chosen[:c], t, *chosen[c + 1 :]]
        for c, column in enumerate(sizes)
        for t in range(len(column))
        if t != chosen[c]
    ]


def _size(sets: DownSets) -> NDArray[np.int64]:
    """int64 (4,), the states of a column, their steps, their ends, and the sum of steps times ends."""
    steps, ends = np.diff(sets.step_start).astype(np.int64), np.diff(sets.top_start).astype(np.int64)
    return np.array([len(steps), steps.sum(), ends.sum(), (steps * ends).sum()])


def _arcs(sizes: list[list[NDArray[np.int64]]], chosen: list[int]) -> int:
    """See ``corridor.extent``."""
    now = [column[t].tolist() for column, t in zip(sizes, chosen, strict=True)]
    if len(now) == 1:
        return int(4 * now[0][3])
    return sum(4 * (a[3] * b[0] + a[0] * b[3] + a[1] * b[2] + a[2] * b[1]) for a, b in pairwise(now))


def _joined(n: int, paths: list[NDArray[np.int32]], parts: list[DownSets]) -> DownSets:
    """The states of all columns, each of which has its own ``paths``, numbered through."""
    local = np.empty(n, np.int32)
    for own, sets in zip(paths, parts, strict=True):
        local[own] = sets.local
    start, step_start, top_start, follow_start = (
        np.concatenate([[0], np.cumsum([ends[-1] for ends in of_parts])])
        for of_parts in zip(
            *[(s.start, s.step_start, s.top_start, s.follow_start) for s in parts], strict=True
        )
    )
    return DownSets(
        start.astype(np.int32),
        _through([s.step_start for s in parts], step_start),
        np.concatenate([own[s.step_path] for own, s in zip(paths, parts, strict=True)]),
        np.concatenate([s.step_to + at for s, at in zip(parts, start, strict=False)]).astype(np.int32),
        np.concatenate([s.step_slot for s in parts]),
        _through([s.top_start for s in parts], top_start),
        np.concatenate([own[s.top_path] for own, s in zip(paths, parts, strict=True)]),
        _through([s.follow_start for s in parts], follow_start),
        np.concatenate([s.follows for s in parts]),
        local,
        np.array([len(own) for own in paths], np.int32),
        np.concatenate([s.corridor for s in parts]),
    )


def _through(starts: list[NDArray[np.int32]], base: NDArray[np.int64]) -> NDArray[np.int32]:
    """Where the rows of each part start, counted on through the parts."""
    moved = [own[:-1] + at for own, at in zip(starts, base, strict=False)]
    return np.concatenate([*moved, base[-1:]]).astype(np.int32)
