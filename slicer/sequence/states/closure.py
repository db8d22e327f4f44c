"""What must come before what: the transitive closure of a section's precedence.

Of one column's toolpaths it may go by way of another one's, where a nozzle's body ties columns.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.states.section import Section


class Closure(NamedTuple):
    """What every printable sequence of some toolpaths has in common.

    Attributes:
        before: bool (n, n), [a, b]: a must come before b.
        never: bool (n, n), [a, b]: in no sequence b is the next of them after a.
    """

    before: NDArray[np.bool_]
    never: NDArray[np.bool_]


def closures_of_columns(section: Section, before: NDArray[np.bool_] | None) -> list[Closure]:
    """That of each column's toolpaths.

    Args:
        section: what is ordered.
        before: ``comes_before`` of it. It need not be known where no column is tied: then none has a say in
            another one's.
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
    n = section.n
    ahead = np.zeros((n, (n + 7) // 8), np.uint8)  # of each toolpath, those before it, a bit each
    missing = np.diff(section.pred_start)
    ready = np.flatnonzero(missing == 0).tolist()
    while ready:
        s = ready.pop()
        for t in section.pred[section.pred_start[s] : section.pred_start[s + 1]].tolist():
            ahead[s] |= ahead[t]
            ahead[s, t >> 3] |= 128 >> (t & 7)
        for t in section.succ[section.succ_start[s] : section.succ_start[s + 1]].tolist():
            missing[t] -= 1
            if missing[t] == 0:
                ready.append(t)
    return np.ascontiguousarray(np.unpackbits(ahead, axis=1, count=n).T).view(np.bool_)


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
