"""Local search where nothing has to come before anything: what lies between two travels is turned round
(2-opt; Croes, Operations Research 6, 1958), and up to three toolpaths go elsewhere (Or-opt; Or, 1976).

Precedence forbids almost all of these moves, so the search for printable sequences has none of them. All are
made of one, ``_turn``, which a log takes back. Kicks that make the path longer are kept less and less often
(Kirkpatrick, Gelatt and Vecchi, Science 220, 1983).

An endpoint's number is twice its toolpath's, plus 1 for the second one; so an oriented toolpath is entered at
the endpoint of its own number and left at that of ``oriented ^ 1``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.problem import draw

LONGEST_MOVED = 3
"""Toolpaths that go elsewhere together."""

KICK = 50
"""How long the blocks may be that a kick lets change places."""

LEAST_GAIN = 1e-9


class Path(NamedTuple):
    """A path through all toolpaths.

    Attributes:
        points: float64 (2n, 2), endpoints in mm.
        near: int32 (2n, k), the nearest endpoints of other toolpaths, negative where there are no more.
        sequence: int32 (n,), oriented toolpaths.
        position: int32 (n,), where each toolpath stands.
        turned: int32 (m, 2), ranges that have been turned round since the log was begun.
        turns: int64 (1,), how many there are.
        queue: int32 (n + 1,), toolpaths to be looked at, in a ring.
        queued: bool (n,), which are there.
        fixed: how many positions at the beginning stay as they are.
        best: int32 (n,), the shortest sequence that there has been.
    """

    points: NDArray[np.float64]
    near: NDArray[np.int32]
    sequence: NDArray[np.int32]
    position: NDArray[np.int32]
    turned: NDArray[np.int32]
    turns: NDArray[np.int64]
    queue: NDArray[np.int32]
    queued: NDArray[np.bool_]
    fixed: int
    best: NDArray[np.int32]


@kernel
def anneal_without_precedence(
    path: Path, state: NDArray[np.uint64], kicks: int, heat: float, cooled: float
) -> float:
    """Descend, then let blocks change places and descend again ``kicks`` times; what the best gains in mm.

    What makes the path longer by d is kept with probability exp(-d / heat), where ``heat`` in mm goes down to
    ``cooled``. The path is the best one in the end.
    """
    n = len(path.sequence)
    for s in range(n):
        path.queue[s] = s
        path.queued[s] = True
        path.best[s] = path.sequence[s]
    gained = _descend(path, n)
    best = 0.0
    for done in range(kicks + 1):
        if gained > best + LEAST_GAIN:
            best = gained
            for s in range(n):
                path.best[s] = path.sequence[s]
        if n - path.fixed < 4 or done == kicks:
            break
        path.turns[0] = 0
        gain = _kick(path, state)
        if gain < 0.0 and -gain > -np.log(max(draw(state), 1e-300)) * (heat + (cooled - heat) * done / kicks):
            for t in range(path.turns[0] - 1, -1, -1):
                _turn_back(path, path.turned[t, 0], path.turned[t, 1])
        else:
            gained += gain
    for s in range(n):
        path.sequence[s] = path.best[s]
        path.position[path.best[s] >> 1] = s
    return best


@inner_kernel
def _kick(path: Path, state: NDArray[np.uint64]) -> float:
    """Let two neighbouring blocks change places and descend from there; the gain of both together."""
    n = len(path.sequence)
    free = n - path.fixed
    longest = min(KICK, free // 3)
    i = path.fixed + int(draw(state) * (free - 2 * longest))
    middle = i + 1 + int(draw(state) * longest)
    k = min(n, middle + 1 + int(draw(state) * longest))
    change = -_around(path, i, middle, k)
    _turn(path, i, k - 1)
    split = i + k - middle
    _turn(path, i, split - 1)
    _turn(path, split, k - 1)
    change += _around(path, i, split, k)
    count = 0
    for at in (i - 1, i, split - 1, split, k - 1, k):
        if 0 <= at < n and not path.queued[path.sequence[at] >> 1]:
            path.queue[count] = path.sequence[at] >> 1
            path.queued[path.queue[count]] = True
            count += 1
    return _descend(path, count) - change


@inner_kernel
def _descend(path: Path, count: int) -> float:
    """Make moves that gain until none of the queued toolpaths, nor what they touch, has one."""
    room = len(path.queue)
    head, gained = 0, 0.0
    while count > 0:
        s = path.queue[head]
        head = (head + 1) % room
        count -= 1
        path.queued[s] = False
        low, high, gain = _best_turn(path, s)
        start, length, to, over, other = _best_shift(path, s)
        if gain <= LEAST_GAIN and other <= LEAST_GAIN:
            continue
        if other > gain:
            gain = other
            low, high = _shift(path, start, length, to, over)
        else:
            _turn(path, low, high)
        gained += gain
        here = 0 + path.position[s]
        for at in (low - 1, low, high, high + 1, here - 1, here):
            if 0 <= at < len(path.sequence):
                touched = path.sequence[at] >> 1
                if not path.queued[touched]:
                    path.queued[touched] = True
                    path.queue[(head + count) % room] = touched
                    count += 1
    return gained


@inner_kernel
def _best_turn(path: Path, s: int) -> tuple[int, int, float]:
    """The best range to turn round that joins an end of toolpath s to a near endpoint, and its gain."""
    n = len(path.sequence)
    best = (0, 0, 0.0)
    at = 0 + path.position[s]
    for side in range(2):
        # Leaving s: exits meet, and the range begins behind s. Entering it: entries meet, before s.
        here = path.sequence[at] ^ (1 - side)
        step = 1 - 2 * side
        if side == 1 and at < max(path.fixed, 1):
            continue  # the first one is entered from nowhere
        other = at + step
        now = _apart(path, here, path.sequence[other] ^ side) if 0 <= other < n else 0.0
        if now <= 0.0:
            continue
        for c in path.near[here]:
            if c < 0:
                break
            to = _apart(path, here, c)
            if to >= now:
                break
            j = 0 + path.position[c >> 1]
            if c != path.sequence[j] ^ (1 - side):
                continue
            beyond = j + step
            if side == 0:
                low, high = (at + 1, j) if j > at else (j + 1, at)
            else:
                low, high = (j, at - 1) if j < at else (at, j - 1)
            if low < path.fixed or low > high:
                continue
            gain = now - to
            if 0 <= beyond < n:
                far = path.sequence[beyond] ^ side
                gain += _apart(path, c, far) - _apart(path, path.sequence[other] ^ side, far)
            if gain > best[2]:
                best = (low, high, gain)
    return best


@inner_kernel
def _best_shift(path: Path, s: int) -> tuple[int, int, int, bool, float]:
    """The best way to put s and what follows it elsewhere: start, length, the position that they go before,
    whether turned round, and the gain.
    """
    n = len(path.sequence)
    best = (0, 0, 0, False, 0.0)
    at = 0 + path.position[s]
    for length in range(1, LONGEST_MOVED + 1):
        for ahead in range(2):
            start = at if ahead == 0 else at - length + 1
            end = start + length  # behind the last
            if start < path.fixed or end > n or (ahead == 1 and length == 1):
                continue
            first, last = path.sequence[start], path.sequence[end - 1] ^ 1
            freed = _travel(path, start) + _travel(path, end)
            if start > 0 and end < n:
                freed -= _apart(path, path.sequence[start - 1] ^ 1, path.sequence[end])
            for side in range(2):
                joined, loose = (first, last) if side == 0 else (last, first)
                for c in path.near[joined]:
                    if c < 0:
                        break
                    to = _apart(path, joined, c)
                    if to >= freed:
                        break
                    j = 0 + path.position[c >> 1]
                    if start <= j < end:
                        continue
                    leaves = c != path.sequence[j]  # whether they are put behind j
                    before = j + 1 if leaves else j
                    if before < path.fixed or before in (start, end):
                        continue
                    added = to
                    if leaves and before < n:
                        added += _apart(path, loose, path.sequence[before])
                    elif not leaves and before > 0:
                        added += _apart(path, path.sequence[before - 1] ^ 1, loose)
                    gain = freed - added + _travel(path, before)
                    if gain > best[4]:
                        over = (side == 0) != leaves
                        best = (start, length, before, over, gain)
    return best


@inner_kernel
def _shift(path: Path, start: int, length: int, to: int, over: bool) -> tuple[int, int]:
    """Put a range before another position by turning ranges round; which positions are others now."""
    end = start + length
    if to > end:
        low, high, inner_low, inner_high = start, to - 1, to - length, to - 1
        rest_low, rest_high = start, to - length - 1
    else:
        low, high, inner_low, inner_high = to, end - 1, to, to + length - 1
        rest_low, rest_high = to + length, end - 1
    _turn(path, low, high)
    _turn(path, rest_low, rest_high)
    if not over:
        _turn(path, inner_low, inner_high)
    return low, high


@inner_kernel
def _turn(path: Path, low: int, high: int) -> None:
    """Turn a range round and note it; a full log is emptied, and what was in it stays done."""
    if path.turns[0] < len(path.turned):
        path.turned[path.turns[0], 0] = low
        path.turned[path.turns[0], 1] = high
        path.turns[0] += 1
    _turn_back(path, low, high)


@inner_kernel
def _turn_back(path: Path, low: int, high: int) -> None:
    while low <= high:
        a, b = path.sequence[low] ^ 1, path.sequence[high] ^ 1
        path.sequence[low], path.sequence[high] = b, a
        path.position[b >> 1] = low
        path.position[a >> 1] = high
        low += 1
        high -= 1


@inner_kernel
def _around(path: Path, i: int, middle: int, k: int) -> float:
    """The travels into three positions."""
    return _travel(path, i) + _travel(path, middle) + _travel(path, k)


@inner_kernel
def _travel(path: Path, to: int) -> float:
    """The travel into a position; none into the first one and behind the last."""
    if to <= 0 or to >= len(path.sequence):
        return 0.0
    return _apart(path, path.sequence[to - 1] ^ 1, path.sequence[to])


@inner_kernel
def _apart(path: Path, a: int, b: int) -> float:
    dx, dy = path.points[a, 0] - path.points[b, 0], path.points[a, 1] - path.points[b, 1]
    return float(np.sqrt(dx * dx + dy * dy))
