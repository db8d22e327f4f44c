"""All that must come before each toolpath, also where the precedence is not planar: a bit for each pair."""

import numpy as np
from numpy.typing import NDArray

FIRST_BIT = 128


def ancestors(
    pred_start: NDArray[np.int32],
    pred: NDArray[np.int32],
    succ_start: NDArray[np.int32],
    succ: NDArray[np.int32],
) -> NDArray[np.uint8]:
    """uint8 (n, n / 8), for each toolpath those that must come before it, in the bits of ``numpy.packbits``.

    Args:
        pred_start, pred, succ_start, succ: the precedence both ways, as in ``Problem``.
    """
    n = len(pred_start) - 1
    ahead = np.zeros((n, (n + 7) // 8), np.uint8)
    missing = np.diff(pred_start)
    ready = np.flatnonzero(missing == 0).tolist()
    while ready:
        s = ready.pop()
        for t in pred[pred_start[s] : pred_start[s + 1]].tolist():
            ahead[s] |= ahead[t]
            ahead[s, t >> 3] |= FIRST_BIT >> (t & 7)
        for t in succ[succ_start[s] : succ_start[s + 1]].tolist():
            missing[t] -= 1
            if missing[t] == 0:
                ready.append(t)
    return ahead


def is_ancestor(
    ahead: NDArray[np.uint8], of: NDArray[np.integer], which: NDArray[np.integer]
) -> NDArray[np.bool_]:
    """bool (m,), whether ``which`` (m,) must come before ``of`` (m,), by ``ancestors``."""
    found: NDArray[np.bool_] = (ahead[of, which >> 3] & (FIRST_BIT >> (which & 7))) != 0
    return found
