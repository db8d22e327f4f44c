"""A lower bound on the cuts that any way of printing takes.

Of two toolpaths that stand in each other's way, parts are printed in turn. To print all of a toolpath that
hinders nothing which remains takes nothing from the other, so no way takes fewer turns than to do just that,
begun with one or the other; and all turns but two are cuts. Pairs without a common toolpath add up.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.cutting.hindering import hindering, hindering_parts
from slicer.nozzle import EPS_MM, NozzleBody

Spans = list[tuple[float, float]]

LEAST = 1e-9
"""In parts of a toolpath: what is shorter counts as nothing."""

MOST_TURNS = 1000


def fewest_cuts(body: NozzleBody, segments: NDArray[np.float64]) -> int:
    """No way of printing a component of toolpaths takes fewer cuts.

    Args:
        segments: float64 (n, 2, 2) in mm, toolpaths that wait for one another.
    """
    hinders = hindering(body, segments)
    pairs = np.argwhere(np.triu(hinders & hinders.T))
    needed = [(fewest_of_pair(body, segments[a], segments[b]), int(a), int(b)) for a, b in pairs]
    used: set[int] = set()
    total = 0
    for cuts, a, b in sorted(needed, reverse=True):
        if a not in used and b not in used:
            used |= {a, b}
            total += cuts
    return max(total, 1)  # a component has a cycle, and a cycle is cut


def fewest_of_pair(body: NozzleBody, a: NDArray[np.float64], b: NDArray[np.float64]) -> int:
    """The cuts without which two toolpaths (2, 2) cannot both be printed; 0 where either may go first."""
    forgiving = body._replace(press=body.press + EPS_MM)  # no less than ``hinders`` is: a bound may not err
    return min(_turns(forgiving, (a, b), 0), _turns(forgiving, (a, b), 1)) - 2


def _turns(body: NozzleBody, pair: tuple[NDArray[np.float64], NDArray[np.float64]], first: int) -> int:
    remaining: list[Spans] = [[(0.0, 1.0)], [(0.0, 1.0)]]
    for turn in range(MOST_TURNS):
        k = (first + turn) % 2
        kept = _hindering_spans(body, pair[k], remaining[k], pair[1 - k], remaining[1 - k])
        if turn and kept == remaining[k]:
            return MOST_TURNS  # begun the wrong way: nothing more can be printed
        remaining[k] = kept
        if not remaining[0] and not remaining[1]:
            return turn + 1
    return MOST_TURNS


def _hindering_spans(
    body: NozzleBody, b: NDArray[np.float64], of_b: Spans, c: NDArray[np.float64], of_c: Spans
) -> Spans:
    """The parts of what remains of b that hinder what remains of c."""
    found: Spans = []
    for low, high in of_b:
        for first, last in of_c:
            parts = hindering_parts(body, _part(b, low, high), _part(c, first, last))
            for begin, end, _, _ in parts.tolist():
                if end - begin > LEAST:
                    found.append((low + begin * (high - low), low + end * (high - low)))
    merged: Spans = []
    for low, high in sorted(found):
        if merged and low <= merged[-1][1] + LEAST:
            merged[-1] = (merged[-1][0], max(high, merged[-1][1]))
        else:
            merged.append((low, high))
    return merged


def _part(s: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    return np.ascontiguousarray(s[0] + np.array([[low], [high]]) * (s[1] - s[0]))
