"""How long a program takes: distance over speed, with the dwells."""

import math
from collections.abc import Iterable, Iterator

from gcode.moves import Kind, Move


def seconds_of(moves: Iterable[Move]) -> Iterator[float]:
    """Estimated seconds of each move; 0 for what is not known, such as homing and heating."""
    before: Move | None = None
    for move in moves:
        seconds = move.seconds
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE) and move.speed_mm_s:
            seconds = length_mm(before, move) / move.speed_mm_s
            before = move
        elif move.kind == Kind.FEED and move.speed_mm_s:
            seconds = abs(move.e_mm) / move.speed_mm_s
        yield seconds


def length_mm(before: Move | None, move: Move) -> float:
    """Length of a move, along the axes whose position before it is known."""
    if before is None:
        return 0.0
    steps = (move.x_mm - before.x_mm, move.y_mm - before.y_mm, move.depth_mm - before.depth_mm)
    return math.hypot(*(step for step in steps if not math.isnan(step)))
