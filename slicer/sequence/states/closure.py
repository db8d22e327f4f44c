"""What must come before what: the transitive closure of a section's precedence.

Of one column's toolpaths it may go by way of another one's, where a nozzle's body ties columns.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem import ancestors
from slicer.sequence.states.section import Section

MOST_TOOLPATHS = 12_000
"""Of more, what comes before what by way of other columns is left out: it takes 144 MB three times over."""


class Closure(NamedTuple):
    """What every printable sequence of some toolpaths has in common.

    Attributes:
        before: bool (n, n), [a, b]: a must come before b.
        never: bool (n, n), [a, b]: in no sequence b is the next of them after a.
    """

    before: NDArray[np.bool_]
    never: NDArray[np.bool_]


def across_columns(section: Section) -> NDArray[np.bool_] | None:
    """``comes_before`` of a section; None where no column is tied, or toolpaths are too many.

    Then what must come before what is known within a column, or a part of the section, alone.
    """
    return comes_before(section) if len(section.ties) and section.n <= MOST_TOOLPATHS else None


def closures_of_columns(section: Section, before: NDArray[np.bool_] | None) -> list[Closure]:
    """That of each column's toolpaths.

    Args:
        section: what is ordered.
        before: ``across_columns`` of it.
    """
    out = []
    for c in range(section.columns):
        if before is None:
            inner = comes_before(section.part(section.column == c))
        else:
            own = np.flatnonzero(section.column == c)
            inner = before[np.ix_(own, own)]
        # Something of another column may come in between: it is this one's next all the same.
        out.append(Closure(inner, _never_next(inner)))
    return out


def comes_before(section: Section) -> NDArray[np.bool_]:
    """bool (n, n), [a, b]: a must come before b."""
    ahead = ancestors(section.pred_start, section.pred, section.succ_start, section.succ)
    return np.ascontiguousarray(np.unpackbits(ahead, axis=1, count=section.n).T).view(np.bool_)


def never_follows(section: Section, before: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """bool (n, n), [a, b]: no sequence prints b directly after a.

    It has to come before a, or something has to come in between.

    Args:
        section: what is ordered.
        before: ``comes_before`` of it.
    """
    never = before | before.T
    np.fill_diagonal(never, True)
    # What must come before another toolpath, and is not told so itself, is so by way of a third one.
    behind = np.ascontiguousarray(before.T)
    for b in range(section.n):
        for a in section.pred[section.pred_start[b] : section.pred_start[b + 1]].tolist():
            never[a, b] = (before[a] & behind[b]).any()
    return never


def _never_next(before: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """``Closure.never`` of some toolpaths, of which nothing but ``before`` is known."""
    between = (before.astype(np.float32) @ before.astype(np.float32)) > 0.5
    never: NDArray[np.bool_] = before.T | between
    np.fill_diagonal(never, True)
    return never
