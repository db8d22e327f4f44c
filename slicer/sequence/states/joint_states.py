"""Which down-sets of different columns go together, where a nozzle's body ties columns by precedence.

A toolpath beside another one, in the next column, can stand in the nozzle's way as one above can. So what is
printed of a sheet is one down-set of each column that is *closed*: whatever a toolpath of it needs in another
column is printed there. Of a point nozzle any down-sets go together.
"""

from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.problem import compressed
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import Section

BITS = 64
SAMPLED = 200
"""Of so many down-sets of a column it is counted what goes together with them. Of 1750 sheets and limits the
share was 83 to 111 % of the true one, mostly within a few per cent.
"""


class Needs(NamedTuple):
    """What toolpaths need of other columns.

    Sets of toolpaths of one column are rows of bits: toolpath s is bit ``sets.local[s]``.

    Attributes:
        start, path: int32 (n + 1,) and (m,); toolpath s needs path[start[s]] .. path[start[s + 1] - 1].
        member: uint64 (d, w), the toolpaths of each down-set.
    """

    start: NDArray[np.int32]
    path: NDArray[np.int32]
    member: NDArray[np.uint64]


def needs(section: Section, sets: DownSets, ties: NDArray[np.int32]) -> Needs:
    """Set up what toolpaths need by the rows ``ties`` (m, 2), (a, b): a of another column comes before b."""
    start, path = compressed(ties[:, 1], ties[:, 0], section.n)
    widest = int(sets.size.max()) if len(ties) else 0
    member = np.zeros((int(sets.start[-1]), -(-widest // BITS)), np.uint64)
    if len(ties):
        _gather(sets, member)
    return Needs(start, path, member)


def members(sets: DownSets) -> NDArray[np.bool_]:
    """bool (d, n), the toolpaths of each down-set of a section of one column."""
    n = len(sets.local)
    member = np.zeros((int(sets.start[-1]), -(-n // BITS)), np.uint64)
    _gather(sets, member)
    bits = np.unpackbits(member.view(np.uint8), axis=1, bitorder="little").astype(np.bool_)
    return bits[:, sets.local]


def needed(section: Section, sets: DownSets, known: Needs, of: int, by: int) -> NDArray[np.uint64]:
    """uint64 (d, w), what each down-set of column ``by`` needs of column ``of``."""
    out = np.zeros((int(sets.counts[by]), known.member.shape[1]), np.uint64)
    _collect(sets, section.column, known, of, by, out)
    return out


def closed_share(section: Section, sets: DownSets, bounds: NDArray[np.int32]) -> float:
    """About which part of the states of blocks is closed: all for a point nozzle, few of tied columns.

    Args:
        section: what is ordered.
        sets: its down-sets.
        bounds: see ``Blocks``, of two columns each or of one.
    """
    ties = section.ties
    if len(ties) == 0:
        return 1.0
    known = needs(section, sets, ties)
    closed = states = 0.0
    for a, b in pairwise(bounds.tolist()):
        rows = np.unique(np.linspace(0, int(sets.counts[a]) - 1, SAMPLED).astype(np.int64))
        pair = _closed(
            known.member[sets.start[a] : sets.start[a + 1]][rows],
            needed(section, sets, known, a, b),
            known.member[sets.start[b] : sets.start[b + 1]],
            needed(section, sets, known, b, a)[rows],
        )
        size = float(sets.counts[a] * (sets.counts[b] if b > a else 1))
        closed, states = closed + (size * float(pair.mean()) if b > a else size), states + size
    return closed / states


def joint_states(
    section: Section, sets: DownSets, bounds: NDArray[np.int32]
) -> list[NDArray[np.bool_]] | None:
    """For each block of columns, bool of the shape of its down-sets: which are closed; None where all are.

    What a block's columns need outside of it is left to the search, see ``out_of_reach``.

    Args:
        section: what is ordered.
        sets: its down-sets.
        bounds: see ``Blocks``.
    """
    ties = section.ties
    if len(ties) == 0:
        return None
    known = needs(section, sets, ties)
    tied = {(int(min(c)), int(max(c))) for c in np.unique(section.column[ties], axis=0)}
    out = []
    for low, high in pairwise(bounds.tolist()):
        shape = sets.counts[low : high + 1].tolist()
        closed = np.ones(shape, np.bool_)
        for a, b in combinations(range(low, high + 1), 2):
            if (a, b) in tied:
                pair = _closed(
                    known.member[sets.start[a] : sets.start[a + 1]],
                    needed(section, sets, known, a, b),
                    known.member[sets.start[b] : sets.start[b + 1]],
                    needed(section, sets, known, b, a),
                )
                beside = [d if c in (a - low, b - low) else 1 for c, d in enumerate(shape)]
                closed &= pair.reshape(beside)
        out.append(closed)
    return out


def out_of_reach(section: Section, home: NDArray[np.int32]) -> NDArray[np.int32]:
    """int32 (m, 2), those of ``Section.ties`` that no block sees both ends of; ``home`` as in ``Blocks``."""
    ties = section.ties
    a, b = home[section.column[ties[:, 0]]], home[section.column[ties[:, 1]]]
    return ties[np.maximum(a[:, 0], b[:, 0]) > np.minimum(a[:, 1], b[:, 1])]


@kernel
def _gather(sets: DownSets, member: NDArray[np.uint64]) -> None:
    """Fill in the toolpaths of each down-set, each from a smaller one."""
    local, step_start, step_path, step_to = sets.local, sets.step_start, sets.step_path, sets.step_to
    for i in range(len(step_start) - 1):
        for e in range(step_start[i], step_start[i + 1]):
            for w in range(member.shape[1]):
                member[step_to[e], w] |= member[i, w]
                if local[step_path[e]] // BITS == w:
                    member[step_to[e], w] |= np.uint64(1) << np.uint64(local[step_path[e]] % BITS)


@kernel
def _collect(
    sets: DownSets, column: NDArray[np.int32], known: Needs, of: int, by: int, out: NDArray[np.uint64]
) -> None:
    """Fill in what the down-sets of column ``by`` need of column ``of``, each from a smaller one."""
    local, step_start, step_path, step_to = sets.local, sets.step_start, sets.step_path, sets.step_to
    first = sets.start[by]
    for i in range(first, sets.start[by + 1]):
        for e in range(step_start[i], step_start[i + 1]):
            s, to = step_path[e], step_to[e] - first
            for w in range(out.shape[1]):
                out[to, w] |= out[i - first, w]
            for t in range(known.start[s], known.start[s + 1]):
                a = known.path[t]
                if column[a] == of:
                    out[to, local[a] // BITS] |= np.uint64(1) << np.uint64(local[a] % BITS)


@inner_kernel
def holds(member: NDArray[np.uint64], i: int, need: NDArray[np.uint64], j: int) -> bool:
    """Whether set i of ``member`` holds all of set j of ``need``."""
    missing = np.uint64(0)
    for w in range(member.shape[1]):
        missing |= need[j, w] & ~member[i, w]
    return bool(missing == np.uint64(0))


@kernel
def _closed(
    member_a: NDArray[np.uint64],
    of_a: NDArray[np.uint64],
    member_b: NDArray[np.uint64],
    of_b: NDArray[np.uint64],
) -> NDArray[np.bool_]:
    """bool (a, b), which down-sets of two columns go together; ``of_a`` is what those of b need of a."""
    out = np.empty((len(member_a), len(member_b)), np.bool_)
    for i in range(len(member_a)):
        for j in range(len(member_b)):
            out[i, j] = holds(member_a, i, of_a, j) and holds(member_b, j, of_b, i)
    return out


@inner_kernel
def needs_printed(
    known: Needs, local: NDArray[np.int32], column: NDArray[np.int32], printed: NDArray[np.int32], s: int
) -> bool:
    """Whether all is printed that toolpath s needs; ``printed`` is the down-set of each column."""
    for t in range(known.start[s], known.start[s + 1]):
        a = known.path[t]
        row = printed[column[a]]
        bit = known.member[row, local[a] // BITS] >> np.uint64(local[a] % BITS)
        if bit & np.uint64(1) == np.uint64(0):
            return False
    return True
